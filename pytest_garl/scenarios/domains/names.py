"""The names of the domains that come with the package, without the cost of reading them."""

from __future__ import annotations

BUILT_IN = ("field", "calm", "paper")
HIDDEN = ("paper-full",)
"""What ``--garl-weather=full`` named; read, but not listed."""
OLD_WEATHER = {"confined": "paper", "full": "paper-full"}
"""The domains that ``--garl-weather`` named."""
DEFAULT_DOMAIN = "field"
"""The domain of a search for which nobody names one."""
