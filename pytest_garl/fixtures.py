"""An alias for one release: ``Landing`` is imported from ``pytest_garl``."""

from pytest_garl.plugin.landing import Landing

__all__ = ["Landing"]
