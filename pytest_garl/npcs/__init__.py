"""The policies that move the NPCs."""
