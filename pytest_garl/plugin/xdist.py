"""pytest-xdist: whether a process is one of its workers, and the keys of what these are given."""

from __future__ import annotations

import pytest

# The keys of ``config.workerinput``, which the controller gives its workers.
CONTROLLER = "garl_controller"
"""The process id of the controller."""
SEED = "garl_seed"
"""The seed of the run: a random one is drawn once."""
WIDTH = "garl_width"
"""The width of the controller's terminal."""


def is_xdist_worker(config: pytest.Config) -> bool:
    """Whether this process is one of pytest-xdist's workers."""
    return hasattr(config, "workerinput")
