"""What a process knows of pytest-xdist: whether it is a worker, and what its controller gave it."""

from __future__ import annotations

from typing import Any

import pytest

# The keys of what the controller gives its workers.
CONTROLLER = "garl_controller"
"""The process id of the controller."""
SEED = "garl_seed"
"""The seed of the run: a random one is drawn once."""
WIDTH = "garl_width"
"""The width of the controller's terminal."""


def is_xdist_worker(config: pytest.Config) -> bool:
    """Whether this process is one of pytest-xdist's workers."""
    return hasattr(config, "workerinput")


def given_by_controller(config: pytest.Config) -> dict[str, Any]:
    """Return what xdist's controller gave this worker; nothing in any other process."""
    found: dict[str, Any] = getattr(config, "workerinput", {})
    return found
