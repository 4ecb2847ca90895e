"""Foxglove's SDK, which writes MCAP files: an extra, so it may be missing."""

from __future__ import annotations

import importlib

from pytest_garl.errors import GarlError


def check_sdk() -> None:
    """Raise GarlError if Foxglove's SDK is not installed."""
    try:
        for name in ("foxglove", "foxglove.mcap"):
            importlib.import_module(name)
    except ImportError as error:
        raise GarlError(
            "an MCAP file needs the package foxglove-sdk, which is not installed; install it with: "
            "pip install 'pytest-garl[mcap]'"
        ) from error
