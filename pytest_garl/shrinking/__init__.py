"""How simple a violation can be, and whether anybody could have prevented it: see ``plan.py``."""
