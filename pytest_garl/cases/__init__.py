"""Saved cases: their file, the folder of all of them, what they say, and their flight today."""
