"""The UAVs of the surrogate: they know the position of the marker and land on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pytest_garl.landing_system import (
    Airframe,
    Command,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.simulation.system_under_test.descent import (
    CENTRED_WITHIN_M,
    centring_velocity,
    descend,
)
from pytest_garl.simulation.system_under_test.ground_truth import Truth, TruthObject, TruthPilot

MOST_CAUTIOUS_M = 3.0
"""No UAV takes notice of an NPC that is farther away horizontally."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightStyle:
    """How a UAV flies: cruise height, horizontal speed and descent speed.

    One that ``begins_in_air`` is at its cruise height from the start.
    """

    cruise_m: float = 10.0
    speed_mps: float = 3.0
    descent_mps: float = 1.0
    begins_in_air: bool = False

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> FlightStyle:
        """Draw a random style, in the range of real landing systems."""
        return cls(
            cruise_m=float(rng.uniform(8.0, 12.0)),
            speed_mps=float(rng.uniform(2.0, 4.0)),
            descent_mps=float(rng.uniform(0.5, 1.2)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class AvoidanceParameters:
    """When a UAV climbs away from NPCs below it.

    It starts to climb, at ``climb_mps``, if an NPC stays for ``delay_s`` within ``radius_m``
    horizontally and less than ``below_m`` below.  It stops when no NPC was there for ``clear_s``.
    """

    radius_m: float = 2.0
    below_m: float = 4.5
    delay_s: float = 0.5
    clear_s: float = 1.0
    climb_mps: float = 1.0

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> AvoidanceParameters:
        """Draw random parameters, because those of a landing system are unknown."""
        return cls(
            radius_m=float(rng.uniform(1.5, MOST_CAUTIOUS_M)),
            below_m=float(rng.uniform(2.5, 6.0)),
            delay_s=float(rng.uniform(0.1, 0.8)),
            clear_s=float(rng.uniform(0.5, 2.0)),
            climb_mps=float(rng.uniform(0.8, 2.0)),
        )


class StraightPilot(TruthPilot):
    """The paper's UAV.

    It "flies directly to the marker without any additional trajectory planning".
    """

    airframe = Airframe()
    needs_camera = False

    def __init__(self, style: FlightStyle | None = None) -> None:
        self._style = style or FlightStyle()

    def reset(self, mission: Mission) -> None:
        """Start on the ground."""
        self._home = mission.home_m
        self._truth: Truth | None = None
        self._at_cruise_height, self._above_marker = self._style.begins_in_air, False

    def observe_truth(self, truth: Truth) -> None:
        """Keep the positions of marker and objects."""
        self._truth = truth

    def step(self, observation: Observation) -> Command:
        """Climb, fly to the marker, descend, land."""
        x, y, z = (float(value) for value in observation.position_m)
        style = self._style
        if self._truth is None:
            return PositionSetpoint(position_m=(x, y, style.cruise_m))
        goal = self._truth.marker_m
        offset = math.dist((x, y), goal)
        self._at_cruise_height |= z > style.cruise_m - 1.0
        if not self._at_cruise_height:
            return PositionSetpoint(position_m=(*self._home[:2], style.cruise_m))
        self._above_marker |= offset < CENTRED_WITHIN_M
        if not self._above_marker:
            return PositionSetpoint(position_m=(*goal, style.cruise_m), speed_mps=style.speed_mps)
        return descend(goal, (x, y, z), style.descent_mps)


class AvoidingPilot(StraightPilot):
    """Climbs away from NPCs that a depth camera under its belly could see."""

    def __init__(
        self, style: FlightStyle | None = None, avoidance: AvoidanceParameters | None = None
    ) -> None:
        super().__init__(style)
        self._avoidance = avoidance or AvoidanceParameters()

    def reset(self, mission: Mission) -> None:
        """Start on the ground, with nothing in sight."""
        super().reset(mission)
        self._camera = mission.camera
        self._seen_since: float | None = None
        self._clear_since = -math.inf
        self._climbing = False

    def step(self, observation: Observation) -> Command:
        """Climb if an NPC is below, land otherwise."""
        now, avoidance, truth = observation.time_s, self._avoidance, self._truth
        if truth is None:
            return super().step(observation)
        position = tuple(float(value) for value in observation.position_m)
        if any(self._is_close_below(item, position) for item in truth.objects):
            self._clear_since = now
            if self._seen_since is None:
                self._seen_since = now
            self._climbing |= now - self._seen_since >= avoidance.delay_s
        else:
            self._seen_since = None
            self._climbing &= now - self._clear_since < avoidance.clear_s
        if self._climbing:
            x, y, z = position
            climb = avoidance.climb_mps if z < self._style.cruise_m else 0.0
            goal = truth.marker_m if self._above_marker else (x, y)
            return VelocitySetpoint(velocity_mps=(*centring_velocity(goal, (x, y)), climb))
        return super().step(observation)

    def _is_close_below(self, item: TruthObject, position: tuple[float, ...]) -> bool:
        """Whether an NPC is closely below, and inside the camera's view."""
        below = position[2] - item.top_m
        dx, dy = abs(item.position_m[0] - position[0]), abs(item.position_m[1] - position[1])
        reach = item.type.radius_m
        if not 0 < below < self._avoidance.below_m:
            return False
        if math.hypot(dx, dy) - reach > self._avoidance.radius_m:
            return False
        # The image's height shows the x axis and its width the y axis: the UAV is level, and its
        # nose points east.
        camera = self._camera
        half_width = math.tan(camera.field_of_view_rad / 2)
        half_height = half_width * camera.height_px / camera.width_px
        return dx - reach < below * half_height and dy - reach < below * half_width
