"""Motion of the dynamic objects: within the limits of their bodies, and around solid ones."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.scenarios.bodies import Body, Disc, discs_of
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.npc_policy import (
    DECISION_STEP_S,
    Move,
    NpcPolicy,
    NpcState,
    Situation,
    decision,
)
from pytest_garl.simulation.physics.bird_path import BirdPath
from pytest_garl.simulation.physics.leap import Leap
from pytest_garl.simulation.physics.locomotion import (
    STANDING_MPS,
    is_far_out,
    limit_mps,
    next_course,
    reserve_after,
    to_the_middle,
)
from pytest_garl.simulation.physics.solids_ahead import course_around, free_velocity, gap_m

Vector = tuple[float, float, float]
SINKS_MPS = 0.2
"""A UAV that sinks faster comes down: engineering estimate, below the slowest descent of landing
systems, 0.3 m/s."""
NEAR_MARKER_M = 3.0
"""A UAV that sinks within this distance of the marker comes down on it: engineering estimate."""
_LOOK_AHEAD_M = 0.5
_CONTACT_RANGE_M = 2.0
"""No two objects farther apart can touch in the next 1/60 s: more than the sum of two radii and of
both ways in that time."""


class Npc:
    """One dynamic object of one flight."""

    def __init__(self, placed: Placed, name: str, policy: NpcPolicy) -> None:
        own = placed.npc(name)
        self.name, self.type, self.policy = name, own.type, policy
        self.speed_mps = own.speed_mps
        self.x_m, self.y_m = own.start_m
        self.z_m = own.height_m
        self.flies = self.type.flies and self.speed_mps > 0
        self._bounds = placed.map.bounds_m
        self.vx_mps = self.vy_mps = self.yaw_rad = 0.0
        if self.flies:
            self.yaw_rad = to_the_middle((self.x_m, self.y_m), self._bounds)
            least = self.type.least_speed_mps
            self.vx_mps = least * math.cos(self.yaw_rad)
            self.vy_mps = least * math.sin(self.yaw_rad)
        self._marker_m = placed.marker_m
        self.met_s = math.inf
        """When it could just meet the UAV; infinite if it could not yet."""
        self.began_s = math.inf
        """When its policy decided that it begins; infinite if it has not."""
        self._reserve_m = self.type.burst_m
        self._leap = Leap(own)
        self.bird_path = BirdPath(own, placed.marker_m) if self.flies else None
        if self.bird_path and self.bird_path.waits:
            self.x_m, self.y_m = self.bird_path.far_away_m
            self.vx_mps = self.vy_mps = 0.0
        self.moves: list[tuple[float, float]] = []
        self.changes: list[tuple[int, str, float]] = []
        self._wanted_velocity_mps = (0.0, 0.0)
        self.vz_mps = 0.0
        lowest_m = self.bird_path.lowest_m if self.bird_path else self.z_m
        self._solids = _solids_at_height_of(self, lowest_m, placed.map.bodies)
        self._solids_in_reach: list[Disc] = []

    @property
    def position_m(self) -> tuple[float, float, float]:
        """Position of the body's frame in the world."""
        return self.x_m, self.y_m, self.z_m

    @property
    def velocity_mps(self) -> tuple[float, float, float]:
        """Velocity in the world."""
        return self.vx_mps, self.vy_mps, self.vz_mps

    @property
    def low_m(self) -> float:
        """Height of its lowest point above the ground."""
        return self.z_m + self.type.low_m

    @property
    def high_m(self) -> float:
        """Height of its highest point above the ground."""
        return self.low_m + self.type.height_m

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
        if move.begins:
            self.began_s = min(self.began_s, situation.time_s)
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
        ahead_m = max(_LOOK_AHEAD_M, 2 * self.type.turn_radius_m)
        reach = self.type.radius_m + self.speed_mps * DECISION_STEP_S + ahead_m
        self._solids_in_reach = [
            solid for solid in self._solids if gap_m(solid, (self.x_m, self.y_m)) < reach
        ]

    def update(
        self, time_s: float, landing_s: tuple[float, ...], uav_m: Vector, uav_mps: Vector
    ) -> None:
        """Take in the time, when the moments of the landing came, and how the UAV moves.

        A bird may come now, and a dog leap.
        """
        if math.isinf(self.met_s) and self._can_just_meet(uav_m, uav_mps):
            self.met_s = time_s
        moments_s = (*landing_s, self.met_s, self.decided_s)
        self._leap.update(time_s, moments_s, (self.x_m, self.y_m), uav_m)
        path = self.bird_path
        if path is not None and path.comes(time_s, moments_s):
            (self.x_m, self.y_m), self.yaw_rad = path.entry_m, path.course_rad
            self.vx_mps = self.speed_mps * math.cos(self.yaw_rad)
            self.vy_mps = self.speed_mps * math.sin(self.yaw_rad)
            self._wanted_velocity_mps = (self.vx_mps, self.vy_mps)

    def _can_just_meet(self, uav_m: Vector, uav_mps: Vector) -> bool:
        """Whether the UAV is down at the NPC's height as soon as the NPC can be below it.

        Both move straight on: the UAV sinks near the marker, the NPC goes at its highest speed.
        """
        sinks_mps = -uav_mps[2]
        if sinks_mps < SINKS_MPS or math.dist(uav_m[:2], self._marker_m) > NEAR_MARKER_M:
            return False
        path = self.bird_path
        place = path.entry_m if path is not None and path.waits else (self.x_m, self.y_m)
        top_m = (path.lowest_m if path is not None else 0.0) + self.type.low_m + self.type.height_m
        left_s = (feet_height_m(uav_m[2]) - top_m) / sinks_mps
        return left_s * self.speed_mps <= math.dist(place, uav_m[:2])

    @property
    def decided_s(self) -> float:
        """When its policy decided to begin; with a policy that decides no begin, when it met."""
        return self.began_s if getattr(self.policy, "decides_begin", False) else self.met_s

    def advance(self, dt_s: float, others: Sequence[Npc] = ()) -> None:
        """Turn and accelerate towards the wanted velocity; slide along solids and ``others``."""
        if self.bird_path is not None:
            if self.bird_path.waits:
                return
            z = self.bird_path.height_m((self.x_m, self.y_m), self.z_m, dt_s)
            self.vz_mps, self.z_m = (z - self.z_m) / dt_s, z
        elif self.type.leap_m > 0:
            z = self._leap.height_m
            self.vz_mps, self.z_m = (z - self.z_m) / dt_s, z
        course, speed = next_course(
            self.type,
            (self.vx_mps, self.vy_mps),
            self.yaw_rad,
            self._wanted_now_mps(),
            dt_s,
            self.flies,
        )
        self._reserve_m = reserve_after(self.type, self._reserve_m, speed, dt_s)
        vx, vy = speed * math.cos(course), speed * math.sin(course)
        solids = [*self._solids_in_reach, *_objects_in_reach(self, others)]
        if solids:
            least = self.type.least_speed_mps if self.flies else 0.0
            place, radius = (self.x_m, self.y_m), self.type.radius_m
            vx, vy = free_velocity(place, (vx, vy), radius, least, dt_s, solids)
        if math.hypot(vx, vy) > STANDING_MPS:
            course = math.atan2(vy, vx)
        turn = math.remainder(course - self.yaw_rad, 2 * math.pi)
        largest_turn = self.type.turn_rate_radps * dt_s
        self.yaw_rad += min(largest_turn, max(-largest_turn, turn))
        self._move(vx, vy, dt_s)

    def _wanted_now_mps(self) -> tuple[float, float]:
        """Return the wanted velocity, as far as reserve, edge and what stands ahead allow."""
        if self._leap.is_airborne:
            return self.vx_mps, self.vy_mps
        x, y = self._wanted_velocity_mps
        asked = math.hypot(x, y)
        limit = limit_mps(self.type, self._reserve_m)
        if asked > limit:
            x, y = x * limit / asked, y * limit / asked
        if not self.flies:
            return x, y
        asked = max(asked, self.type.least_speed_mps)
        if is_far_out((self.x_m, self.y_m), self._bounds):
            course = to_the_middle((self.x_m, self.y_m), self._bounds)
            return asked * math.cos(course), asked * math.sin(course)
        if not self._solids_in_reach:
            return x, y
        place, course = (self.x_m, self.y_m), math.atan2(self.vy_mps, self.vx_mps)
        passing = course_around(place, course, self.type, self._solids_in_reach)
        if passing == course and (x or y):
            course = math.atan2(y, x)
            passing = course_around(place, course, self.type, self._solids_in_reach)
        return (x, y) if passing == course else (math.cos(passing), math.sin(passing))

    def _move(self, vx: float, vy: float, dt_s: float) -> None:
        """Move on; walkers stop at the edge of the map."""
        x, y = self.x_m + vx * dt_s, self.y_m + vy * dt_s
        x_min, x_max, y_min, y_max = self._bounds
        if self.flies:
            self.x_m, self.y_m = x, y
        else:
            self.x_m, self.y_m = min(x_max, max(x_min, x)), min(y_max, max(y_min, y))
        self.vx_mps = vx if self.x_m == x else 0.0
        self.vy_mps = vy if self.y_m == y else 0.0

    def place(
        self,
        position_m: tuple[float, float, float],
        velocity_mps: tuple[float, float],
        yaw_rad: float,
    ) -> None:
        """Put it somewhere in motion, as a record says."""
        self.x_m, self.y_m, self.z_m = position_m
        self.vx_mps, self.vy_mps = velocity_mps
        self.yaw_rad = yaw_rad

    def spend_reserve(self, speeds_mps: Sequence[float], dt_s: float) -> None:
        """Take in the speeds at which it ran before it was placed."""
        for speed in speeds_mps:
            self._reserve_m = reserve_after(self.type, self._reserve_m, speed, dt_s)


def _objects_in_reach(npc: Npc, others: Sequence[Npc]) -> list[Disc]:
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
        if abs(other.x_m - npc.x_m) < _CONTACT_RANGE_M
        and abs(other.y_m - npc.y_m) < _CONTACT_RANGE_M
        and other is not npc
        and other.low_m < npc.high_m
        and npc.low_m < other.high_m
    ]


def _solids_at_height_of(npc: Npc, lowest_m: float, bodies: Sequence[Body]) -> tuple[Disc, ...]:
    low_m = lowest_m + npc.type.low_m
    return tuple(
        disc
        for body in bodies
        for disc in discs_of(body)
        if disc.low_m < npc.high_m and low_m < disc.high_m
    )
