"""Whether a changed landing stack is worse: rates of violations on the very same scenarios."""
