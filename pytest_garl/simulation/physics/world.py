"""The physics of one flight: what an engine must do, and the shapes and figures that engines share.

``bullet_world.py`` and ``mujoco_world.py`` do it, each the only module that imports its engine;
``make_world.py`` takes the one that was chosen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M
from pytest_garl.scenarios.bodies import Body, Part
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector

PHYSICS_RATE_HZ = 240
EXACT_RANGE_M = 3.0
"""An engine computes distances up to this one; longer ones are those of bounding spheres."""
BODY_FRICTION = 0.5
"""Coefficient of friction between the hull and a body other than the ground: Bullet's default.  A
contact with a body that stands there ends a flight, so it decides little."""
BALL_FILE = Path(__file__).with_name("unit_ball.obj")
"""Vertices of a ball of diameter 1 as the camera draws it: 10 sides, 5 rings; engines use their
convex hull for ellipsoids, so that what can be hit is what can be seen."""
_DISC_M = 0.10


@dataclass(frozen=True, slots=True, kw_only=True)
class HullContact:
    """A contact of the UAV's hull with a body, or with "ground"."""

    body: str
    position_m: Vector


class World(Protocol):
    """One flight's physics: ground, static bodies, dynamic objects and the UAV's hull.

    A world is built for one flight and closed after it, so that equal flights begin with equal
    bytes.
    """

    def close(self) -> None:
        """Free what the engine holds."""

    def step(self, position: Vector, force: Vector, torque: Vector) -> None:
        """Apply a force and a torque to the UAV at ``position`` and advance by 1/240 s.

        All three are in the world frame.
        """

    def uav_state(self) -> tuple[Vector, Quaternion, Vector, Vector]:
        """Position, attitude, velocity and angular velocity of the UAV, in the world frame."""

    def move(self, name: str, position_m: Vector, yaw_rad: float, velocity: Vector) -> None:
        """Move a dynamic object to a pose; ``velocity`` is for engines whose contacts need it."""

    def place_uav(self, position: Vector, attitude: Quaternion) -> None:
        """Move the UAV to a pose, at rest: to begin a flight there, or to measure distances."""

    def ground_gap_m(self) -> float:
        """Return the distance in metres from the UAV's hull to the ground, up to 3 m."""

    def distance_m(self, start: Vector, direction: Vector, most_m: float) -> float | None:
        """Return the distance from a place to the first body in a direction, the hull excepted.

        ``direction`` has length 1.  None if nothing lies within ``most_m``.
        """

    def hull_contacts(self) -> tuple[HullContact, ...]:
        """Return the UAV's present contacts, one per body."""

    def separations(self) -> dict[str, float]:
        """Return the distance in metres from the UAV's hull to each body except the ground.

        Exact within 3 m; beyond that the distance of bounding spheres, which is smaller.
        """


def hull_parts(size_m: float) -> tuple[Part, Part]:
    """Return the UAV's hull: a cylinder for the rotors, and below it a box for the landing gear."""
    gear, side = BODY_ABOVE_FEET_M - 0.02, 0.36 * size_m
    return (
        Part(shape="cylinder", size_m=(size_m, size_m, _DISC_M), position_m=(0.0, 0.0, 0.03)),
        Part(shape="box", size_m=(side, side, gear), position_m=(0.0, 0.0, -0.02 - gear / 2)),
    )


class Spheres:
    """Bounding spheres of bodies by name, for distances that need not be exact."""

    def __init__(self, bodies: Sequence[Body], size_m: float) -> None:
        self._hull_m = size_m * 0.6
        self._found = {
            body.name: (
                body.position_m,
                max(
                    math.hypot(*part.position_m) + math.hypot(*part.size_m) / 2
                    for part in body.parts
                ),
            )
            for body in bodies
        }

    def move(self, name: str, position_m: Vector) -> None:
        """Move the sphere of a body."""
        self._found[name] = (position_m, self._found[name][1])

    def gaps_m(self, uav_m: Vector) -> list[tuple[str, float]]:
        """Return each body's name with the least distance that it may have from the UAV's hull."""
        return [
            (name, math.dist(uav_m, centre) - radius - self._hull_m)
            for name, (centre, radius) in self._found.items()
        ]
