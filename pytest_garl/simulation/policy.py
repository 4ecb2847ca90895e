"""An alias for one release: these names are imported from ``pytest_garl``."""

from pytest_garl.simulation.npc_policy import *  # noqa: F403
