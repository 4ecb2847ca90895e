"""Benchmarks of speed; ``python -m benchmarks`` runs the quick ones."""
