"""Operational domains: the conditions in which a team claims that its system lands."""
