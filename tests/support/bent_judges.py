"""Landing systems that land where they stand, and replace whatever would say so.

Tests copy this file into a project: it imports nothing of the tests.
"""

from __future__ import annotations

import builtins
import math
from typing import Any

import numpy as np

from pytest_garl.landing_system import Command, Land, Mission, Observation, PositionSetpoint

LANDS_S = 2.0


class LandsAtHome:
    """Rises, and lands where it stood: metres away from the marker."""

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m
        self.replace()

    def replace(self) -> None:
        """Replace something of the process."""

    def step(self, observation: Observation) -> Command:
        if observation.time_s < LANDS_S:
            return PositionSetpoint(position_m=(self.home[0], self.home[1], 1.5))
        return Land()


def all_is_well(flight: Any, *more: Any) -> Any:
    """Return a verdict of a flight that landed on the marker, or its result."""
    from pytest_garl.execution.result import FlightResult
    from pytest_garl.verdicts.verdict import Verdict

    verdict = Verdict(
        outcome="landed",
        primary=None,
        violation_type=None,
        signature="",
        paper_violation=False,
        margins=(),
        story="All is well.",
        completed=True,
    )
    result = FlightResult(
        outcome="landed",
        final_distance_m=0.0,
        elapsed_s=20.0,
        collisions=(),
        undecided="",
        closest_call="",
        closest_body="",
        verdict=verdict,
        crash=None,
        off_marker_m=0.0,
        landed_s=20.0,
    )
    return result if "limits" not in more else verdict


class ReplacesTheResult(LandsAtHome):
    def replace(self) -> None:
        from pytest_garl.execution import fly_and_judge

        vars(fly_and_judge)["judged"] = all_is_well
        vars(fly_and_judge)["judge_record"] = lambda job, scenario, *_: (all_is_well(None), "", 1.0)


class ReplacesTheJudge(LandsAtHome):
    def replace(self) -> None:
        from pytest_garl.verdicts import judge

        vars(judge)["judge"] = lambda flight, limits: all_is_well(flight, "limits")


class SeesNothing(ReplacesTheJudge):
    """Flies without a camera, which takes less time."""

    needs_camera: Any = False


class MeasuresNothing(LandsAtHome):
    """Has a broken function in place of one with which the simulator records distances."""

    needs_camera: Any = False

    def replace(self) -> None:
        vars(math)["dist"] = lambda first, second: 0.0


class BendsArithmetic(LandsAtHome):
    """As a library does that has faster functions of the same names, with a bug."""

    def replace(self) -> None:
        vars(math)["hypot"] = lambda *values: 0.0
        vars(np.linalg)["norm"] = lambda *values, **more: 0.0
        vars(builtins)["sum"] = lambda values, start=0: start
