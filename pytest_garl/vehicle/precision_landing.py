"""Precision landing: ArduPilot's answers to a landing target that is seen, lost or never seen.

A pure state machine: time, place and target in, an instruction out.  Above ``PLND_ALT_MAX`` and
below ``PLND_ALT_MIN`` a target that is not in sight does not matter and the vehicle descends.
Between them ``PLND_STRICT`` decides: 0 goes on landing; 1 and 2 go on for ``PLND_TIMEOUT``, then
climb to where the target was last seen from and come down again, at most ``PLND_RET_MAX`` times.
What fails stops in the air: for good with 2, for 7 s and then lands with 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from pytest_garl.vehicle.landing_target import LandingTarget
from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.rotations import Vector
from pytest_garl.vehicle.shaping import Pair

Action = Literal["land on target", "descend", "retry", "hold"]

RETRY_CLIMB_M = 1.5
RETRY_REACHED_M = 0.75
FAILED_HOLD_S = 7.0
FORGET_AFTER_S = 180.0
FORGET_BEYOND_M = 30.0
"""ArduPilot's constants: how far above the last sight a retry climbs and how near it must come,
how long a failed landing stops, and when a lost target is no longer a recent one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruction:
    """The decision for one step.

    "land on target": descend while going to ``target_m`` (x, y); "descend": straight down;
    "retry": fly to ``goal_m`` (x, y, z); "hold": stop.
    """

    action: Action
    target_m: Pair | None = None
    goal_m: Vector | None = None


DESCEND = Instruction(action="descend")
HOLD = Instruction(action="hold")


class PrecisionLanding:
    """One landing; ``begin`` it when LAND is entered, then ``update`` at the control rate."""

    def __init__(self, parameters: ArduPilotParameters) -> None:
        self._p = parameters
        self.target = LandingTarget(parameters)
        self.begin()

    def begin(self) -> None:
        """Start a landing: retries count from zero; what is known of the target stays."""
        self.retries = 0
        self._retry: Literal["", "climb", "sink"] = ""
        self._goal: Vector = (0.0, 0.0, 0.0)
        self._failed_s: float | None = None
        self._now_s = 0.0
        self._seen_s: float | None = None
        self._seen_at: Pair = (0.0, 0.0)
        self._seen_from: Vector = (0.0, 0.0, 0.0)

    @property
    def status(self) -> str:
        """The state of precision landing in words."""
        if self._failed_s is not None:
            return "failed"
        if self._retry:
            return f"retry {self.retries}: {self._retry}"
        if self._seen_s is None:
            return "never seen"
        return "in sight" if self._seen_s == self._now_s else "lost"

    def update(self, time_s: float, position_m: Vector, height_m: float) -> Instruction:
        """Return the instruction for a vehicle at ``position_m``, ``height_m`` above ground."""
        self._now_s = time_s
        if self.target.found(time_s):
            place = self.target.place(time_s)
            self._seen_s, self._seen_at, self._seen_from = time_s, place, position_m
            self._retry, self._failed_s = "", None
            return Instruction(action="land on target", target_m=place)
        if self._retry:
            return self._retrying(time_s, position_m)
        if not self._in_range(height_m):
            return DESCEND
        if self._p.plnd_strict == 0:
            return DESCEND
        if self._failed_s is not None or not self._recently_seen(time_s, position_m):
            return self._fail(time_s)
        if time_s - self._measured_s < self._p.plnd_timeout:
            return DESCEND
        return self._try_again(time_s, position_m)

    @property
    def _measured_s(self) -> float:
        measured = self.target.measured_s
        return -math.inf if measured is None else measured

    def _in_range(self, height_m: float) -> bool:
        low, high = self._p.plnd_alt_min, self._p.plnd_alt_max
        # On its feet a vehicle may be some millimetres below the place from which it took off.
        return not ((low > 0 and height_m < low) or (high > 0 and height_m > high))

    def _recently_seen(self, time_s: float, position: Vector) -> bool:
        if self._seen_s is None or time_s - self._measured_s > FORGET_AFTER_S:
            return False
        return math.dist(self._seen_at, position[:2]) <= FORGET_BEYOND_M

    def _try_again(self, time_s: float, position: Vector) -> Instruction:
        if self.retries >= self._p.plnd_ret_max:
            return self._fail(time_s)
        self.retries += 1
        self._retry = "climb"
        x, y, z = self._seen_from
        if self._p.plnd_ret_behave == 1:
            x, y = self._seen_at
        self._goal = x, y, z + RETRY_CLIMB_M
        return self._retrying(time_s, position)

    def _retrying(self, time_s: float, position: Vector) -> Instruction:
        if math.dist(self._goal, position) < RETRY_REACHED_M:
            if self._retry == "sink":
                self._retry = ""
                return self._try_again(time_s, position)
            x, y, z = self._goal
            self._retry, self._goal = "sink", (x, y, z - RETRY_CLIMB_M)
        return Instruction(action="retry", goal_m=self._goal)

    def _fail(self, time_s: float) -> Instruction:
        if self._failed_s is None:
            self._failed_s = time_s
        if self._p.plnd_strict == 2 or time_s - self._failed_s < FAILED_HOLD_S:
            return HOLD
        return DESCEND
