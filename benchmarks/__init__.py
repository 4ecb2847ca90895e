"""Measurements of speed, as ratios where machines are noisy; run with python -m benchmarks."""
