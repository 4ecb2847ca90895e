"""Saved cases: violations that are confirmed, shrunk, saved and flown before every merge."""
