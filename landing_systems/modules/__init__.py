"""Modules that the reference landing systems share."""
