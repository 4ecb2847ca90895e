"""Show: the terminal."""
