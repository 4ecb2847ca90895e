"""Python programs that fly unchanged, in the time of the flight."""
