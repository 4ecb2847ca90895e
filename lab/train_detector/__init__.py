"""Trains TPHYolo-MLS's networks: data, losses, export and scores."""
