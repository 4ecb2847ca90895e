"""An alias for one release: ``save_video`` is imported from ``pytest_garl``."""

from pytest_garl.reports.film import save_video

__all__ = ["save_video"]
