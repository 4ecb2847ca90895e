"""Hooks by which users extend pytest-garl."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


@pytest.hookspec(firstresult=True)
def pytest_garl_fly(config: pytest.Config) -> Callable[..., Any] | None:
    """Return a function that flies instead of the built-in simulator.

    It takes ``(scenario, system, npcs, *, map, time_limit_s, guard)`` and returns a
    ``pytest_garl.simulation.flight.Flight``.  It must be importable by name, because child
    processes call it.
    """
