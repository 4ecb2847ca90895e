"""Motion of the dynamic objects: bounded in speed and acceleration, and around solid bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pytest_garl.scenarios.bodies import Body
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placement import object_speed_mps, object_start_m
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import Disc, discs_of
from pytest_garl.simulation.npc_policy import (
    DECISION_STEP_S,
    Move,
    NpcPolicy,
    NpcState,
    Situation,
    decision,
)

_LOOK_AHEAD_M = 0.5
_CONTACT_RANGE_M = 2.0
"""No two objects farther apart can touch in the next 1/60 s: more than the sum of two radii and of
both ways in that time."""
TURN_RATE_RADPS = 2 * math.pi
"""A person or an animal turns around on the spot in about a second: engineering estimate."""


class Npc:
    """One dynamic object of one flight."""

    def __init__(self, scenario: Scenario, map: Map, name: str, policy: NpcPolicy) -> None:
        kind = dict(map.present_objects)[name]
        self.name = name
        self.type = OBJECT_TYPES[kind]
        self.policy = policy
        self.speed_mps = object_speed_mps(scenario, map, name)
        self.x_m, self.y_m = object_start_m(scenario, map, name)
        self.vx_mps = self.vy_mps = 0.0
        self.yaw_rad = 0.0
        self.moves: list[tuple[float, float]] = []
        self.changes: list[tuple[int, str, float]] = []
        self._wanted_velocity_mps = (0.0, 0.0)
        self._bounds = map.bounds_m
        self.low_m, self.high_m = self.type.bottom_m, self.type.top_m
        self._solids = _solids_at_height_of(self, map.bodies)
        self._solids_in_reach: list[Disc] = []

    @property
    def position_m(self) -> tuple[float, float, float]:
        """Position of the body's frame in the world."""
        return self.x_m, self.y_m, self.type.altitude_m

    @property
    def body(self) -> Body:
        """The body that the physics gets at the start of the flight."""
        return Body(
            name=self.name,
            kind=self.type.name,
            parts=self.type.parts,
            position_m=self.position_m,
            yaw_rad=self.yaw_rad,
        )

    @property
    def state(self) -> NpcState:
        """The part of its state that policies may see."""
        return NpcState(
            name=self.name,
            type=self.type,
            position_m=self.position_m,
            velocity_mps=(self.vx_mps, self.vy_mps),
            speed_mps=self.speed_mps,
        )

    def decide(self, situation: Situation) -> Move:
        """Ask the policy where to go; raise PolicyError if it fails or returns an invalid move."""
        move = decision(self.policy, situation)
        self._start_move(move)
        return move

    def _start_move(self, move: Move) -> None:
        """Set the wanted velocity until the next decision, and record the move."""
        self.changes += [(len(self.moves), key, float(by)) for key, by in move.changes]
        # Without negative zeros, so that moves that compare equal are the same to the byte.
        x, y = move.x + 0.0, move.y + 0.0
        self.moves.append((x, y))
        self._wanted_velocity_mps = (x * self.speed_mps, y * self.speed_mps)
        # The few solids, mostly none, that it can reach before the next decision.
        reach = self.type.radius_m + self.speed_mps * DECISION_STEP_S + _LOOK_AHEAD_M
        self._solids_in_reach = [
            solid for solid in self._solids if _gap(solid, self.x_m, self.y_m) < reach
        ]

    def advance(self, dt_s: float, others: Sequence[Npc] = ()) -> None:
        """Accelerate towards the wanted velocity; slide along solids and ``others``."""
        dvx, dvy = (
            self._wanted_velocity_mps[0] - self.vx_mps,
            self._wanted_velocity_mps[1] - self.vy_mps,
        )
        change = math.hypot(dvx, dvy)
        allowed = self.type.acceleration_mps2 * dt_s
        share = min(1.0, allowed / change) if change > 0 else 0.0
        vx, vy = self.vx_mps + share * dvx, self.vy_mps + share * dvy
        solids = [*self._solids_in_reach, *self._objects_in_reach(others)]
        if solids:
            vx, vy = self._slide(vx, vy, dt_s, solids)
        x_min, x_max, y_min, y_max = self._bounds
        x, y = self.x_m + vx * dt_s, self.y_m + vy * dt_s
        self.x_m, self.y_m = min(x_max, max(x_min, x)), min(y_max, max(y_min, y))
        self.vx_mps = vx if self.x_m == x else 0.0
        self.vy_mps = vy if self.y_m == y else 0.0
        if math.hypot(vx, vy) > 0.05:
            turn = math.remainder(math.atan2(vy, vx) - self.yaw_rad, 2 * math.pi)
            largest_turn = TURN_RATE_RADPS * dt_s
            self.yaw_rad += min(largest_turn, max(-largest_turn, turn))

    def _objects_in_reach(self, others: Sequence[Npc]) -> list[Disc]:
        """Return the other objects that it could touch: near enough, and of overlapping heights."""
        return [
            Disc(
                name=other.name,
                x_m=other.x_m,
                y_m=other.y_m,
                radius_m=other.type.radius_m,
                low_m=other.low_m,
                high_m=other.high_m,
            )
            for other in others
            if abs(other.x_m - self.x_m) < _CONTACT_RANGE_M
            and abs(other.y_m - self.y_m) < _CONTACT_RANGE_M
            and other is not self
            and other.low_m < self.high_m
            and self.low_m < other.high_m
        ]

    def _slide(
        self, vx: float, vy: float, dt_s: float, solids: Sequence[Disc]
    ) -> tuple[float, float]:
        for solid in solids:
            x, y = self.x_m + vx * dt_s, self.y_m + vy * dt_s
            reach = solid.radius_m + self.type.radius_m
            nx, ny = x - solid.x_m, y - solid.y_m
            distance = math.hypot(nx, ny)
            if 0 < distance < reach:
                inward = (vx * nx + vy * ny) / distance
                if inward < 0:
                    vx, vy = vx - inward * nx / distance, vy - inward * ny / distance
        x, y = self.x_m + vx * dt_s, self.y_m + vy * dt_s
        for solid in solids:
            if _gap(solid, x, y) < min(_gap(solid, self.x_m, self.y_m), self.type.radius_m):
                return 0.0, 0.0
        return vx, vy


def _gap(solid: Disc, x: float, y: float) -> float:
    return math.hypot(x - solid.x_m, y - solid.y_m) - solid.radius_m - 1e-9


def _solids_at_height_of(npc: Npc, bodies: Sequence[Body]) -> tuple[Disc, ...]:
    return tuple(
        disc
        for body in bodies
        for disc in discs_of(body)
        if disc.low_m < npc.high_m and npc.low_m < disc.high_m
    )
