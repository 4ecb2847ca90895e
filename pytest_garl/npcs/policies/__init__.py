"""The scripted NPC policies: one module each, with the name of the policy."""
