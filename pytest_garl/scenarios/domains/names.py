"""The names of the domains that come with the package, without the cost of reading them."""

from __future__ import annotations

BUILT_IN = ("field", "calm", "paper")
DEFAULT_DOMAIN = "field"
"""The domain of a search for which nobody names one."""
