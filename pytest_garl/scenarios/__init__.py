"""Inputs of a flight: genes, chromosomes, scenarios, maps and their files."""
