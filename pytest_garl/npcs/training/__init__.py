"""Trains the learned NPC policies; needs the extra ``train``."""
