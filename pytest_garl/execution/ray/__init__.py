"""Flights on a Ray cluster."""
