"""Foxglove's SDK, which writes MCAP files: an extra, so it may be missing."""

from __future__ import annotations

import importlib.util

from pytest_garl.errors import GarlError


def check_sdk() -> None:
    """Raise GarlError if Foxglove's SDK is not installed."""
    try:
        found = importlib.util.find_spec("foxglove.mcap") is not None
    except (ImportError, ValueError):
        found = False
    if not found:
        raise GarlError(
            "an MCAP file needs the package foxglove-sdk, which is not installed; install it with: "
            "pip install 'pytest-garl[mcap]'"
        )
