"""The placebo: a landing system whose difference from the control is no fault."""

from __future__ import annotations

from lab.faults.control import ControlSystem, Parameters


class Placebo(ControlSystem):
    """Approaches the pad one percent faster.

    Whatever finds it is chance: an NPC meets one of two flights that are never quite alike.
    """

    parameters = Parameters(approach_mps=2.02)
