"""What a run found, as data: for the terminal, for ``garl report`` and other programs."""
