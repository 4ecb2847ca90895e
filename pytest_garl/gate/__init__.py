"""Whether a changed landing system is worse, on the very same scenarios."""
