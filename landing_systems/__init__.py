"""The reference landing systems of this repository and their tests."""
