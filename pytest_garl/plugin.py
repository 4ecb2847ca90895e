"""The pytest hooks of pytest-garl, and nothing else."""
