"""Hooks for users who extend pytest-garl."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


@pytest.hookspec(firstresult=True)
def pytest_garl_fly(config: pytest.Config) -> Callable[..., Any] | None:
    """Return a function that flies instead of the built-in simulator.

    The function takes ``(scenario, system, npcs, *, map, time_limit_s, guard)`` and returns a
    ``pytest_garl.Flight``.  It must be importable by name, because worker processes call it.
    """
