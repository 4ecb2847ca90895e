"""Simulation of one flight: the flight loop, its recorder and its record."""
