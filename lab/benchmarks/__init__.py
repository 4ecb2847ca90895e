"""Benchmarks of speed; ``python -m lab.benchmarks`` runs the quick ones."""
