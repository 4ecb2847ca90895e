"""The findings of a run as data: for the terminal, ``garl report`` and other programs."""
