"""The UAVs of the surrogate: they know the place of the marker and land on it."""

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
from pytest_garl.simulation.system_under_test.ground_truth import Truth, TruthObject


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightStyle:
    """How a UAV flies: cruise height, speeds over ground and downwards."""

    cruise_m: float = 10.0
    speed_mps: float = 3.0
    descent_mps: float = 1.0

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> FlightStyle:
        """Draw a style; styles differ as much as those of landing systems."""
        return cls(
            cruise_m=float(rng.uniform(8.0, 12.0)),
            speed_mps=float(rng.uniform(2.0, 4.0)),
            descent_mps=float(rng.uniform(0.5, 1.2)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class AvoidanceParameters:
    """When a UAV climbs away from NPCs that its depth camera shows.

    It climbs from an NPC that is within ``radius_m`` of its column and ``below_m`` under it, after
    ``delay_s``, at ``climb_mps``, until there was none for ``clear_s``.
    """

    radius_m: float = 2.0
    below_m: float = 4.5
    delay_s: float = 0.5
    clear_s: float = 1.0
    climb_mps: float = 1.0

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> AvoidanceParameters:
        """Draw parameters, because those of a landing system are unknown."""
        return cls(
            radius_m=float(rng.uniform(1.5, 3.0)),
            below_m=float(rng.uniform(2.5, 6.0)),
            delay_s=float(rng.uniform(0.1, 0.8)),
            clear_s=float(rng.uniform(0.5, 2.0)),
            climb_mps=float(rng.uniform(0.8, 2.0)),
        )


class StraightPilot:
    """The paper's: it "flies directly to the marker without any additional trajectory planning"."""

    airframe = Airframe()
    needs_camera = False

    def __init__(self, style: FlightStyle | None = None) -> None:
        self._style = style or FlightStyle()

    def reset(self, mission: Mission) -> None:
        """Start on the ground."""
        self._home = mission.home_m
        self._truth: Truth | None = None
        self._up = self._there = False

    def observe_truth(self, truth: Truth) -> None:
        """Take in where everything is."""
        self._truth = truth

    def step(self, observation: Observation) -> Command:
        """Climb, cross, descend, land."""
        x, y, z = (float(value) for value in observation.position_m)
        style = self._style
        if self._truth is None:
            return PositionSetpoint(position_m=(x, y, style.cruise_m))
        goal = self._truth.marker_m
        offset = math.dist((x, y), goal)
        self._up |= z > style.cruise_m - 1.0
        if not self._up:
            return PositionSetpoint(position_m=(*self._home[:2], style.cruise_m))
        self._there |= offset < CENTRED_WITHIN_M
        if not self._there:
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
        place = tuple(float(value) for value in observation.position_m)
        if any(self._is_close_below(item, place) for item in truth.objects):
            self._clear_since = now
            if self._seen_since is None:
                self._seen_since = now
            self._climbing |= now - self._seen_since >= avoidance.delay_s
        else:
            self._seen_since = None
            self._climbing &= now - self._clear_since < avoidance.clear_s
        if self._climbing:
            x, y, z = place
            climb = avoidance.climb_mps if z < self._style.cruise_m else 0.0
            goal = truth.marker_m if self._there else (x, y)
            return VelocitySetpoint(velocity_mps=(*centring_velocity(goal, (x, y)), climb))
        return super().step(observation)

    def _is_close_below(self, item: TruthObject, place: tuple[float, ...]) -> bool:
        """Whether an NPC is near the column below, and inside the camera's view."""
        below = place[2] - item.type.top_m
        dx, dy = abs(item.position_m[0] - place[0]), abs(item.position_m[1] - place[1])
        reach = item.type.radius_m
        if not 0 < below < self._avoidance.below_m:
            return False
        if math.hypot(dx, dy) - reach > self._avoidance.radius_m:
            return False
        # On a level UAV with its nose east the frame is as high as it reaches along x, and as
        # wide as it reaches along y.
        camera = self._camera
        wide = math.tan(camera.field_of_view_rad / 2)
        high = wide * camera.height_px / camera.width_px
        return dx - reach < below * high and dy - reach < below * wide
