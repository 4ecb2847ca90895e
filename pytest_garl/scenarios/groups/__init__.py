"""Conditions of a flight in physical units, one module per group; `catalogue.py` lists them."""
