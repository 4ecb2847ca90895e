"""How the learned NPC policies are trained; needs the extra ``train``."""
