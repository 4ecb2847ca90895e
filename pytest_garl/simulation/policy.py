"""An alias for one release: ``Move``, ``PolicySpec`` and ``Situation`` stand in ``pytest_garl``."""

from pytest_garl.simulation.npc_policy import (
    DECISION_STEP_S,
    Move,
    PolicySpec,
    Situation,
)
from pytest_garl.simulation.npc_policy import NpcPolicy as ObjectPolicy
from pytest_garl.simulation.npc_policy import NpcState as ObjectState

__all__ = ["DECISION_STEP_S", "Move", "ObjectPolicy", "ObjectState", "PolicySpec", "Situation"]
