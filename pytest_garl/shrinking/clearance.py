"""Clearance: whether a UAV keeps its distance from everything along a track."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Airframe
from pytest_garl.scenarios.bodies import Body
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.simulation.physics.make_world import make_world
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector, vehicle_model
from pytest_garl.simulation.physics.world import World

KEPT_M = 0.3
"""Distance that an escape keeps between the UAV's hull and everything else, the ground included."""
REACHED_AFTER_S = 1.0
"""A UAV that is nearer when the escape begins has this time to get clear."""
CLOSER_M = 0.02
"""Until then it may come nearer by this distance, because a tilted hull reaches farther."""
LAST_TILT_RAD = math.radians(45)
"""A UAV that is tilted further in the end does not hover: the flight control's limit is 25°."""
GROUND = "ground"

ObjectPose = tuple[str, Vector, float]
"""Name, position and yaw of a moving body."""


class Clearance:
    """Judges one escape, sample by sample; times are those since its begin."""

    def __init__(self, world: World, kept_m: float = KEPT_M) -> None:
        self._world, self._kept_m = world, kept_m
        self._first: dict[str, float] = {}

    def holds(
        self,
        elapsed_s: float,
        position: Vector,
        attitude: Quaternion,
        objects: Sequence[ObjectPose],
    ) -> bool:
        """Return whether the UAV is far enough from everything at this moment."""
        for name, place, yaw in objects:
            self._world.move(name, place, yaw, (0.0, 0.0, 0.0))
        self._world.place_uav(position, attitude)
        gaps = self._world.separations()
        gaps[GROUND] = self._world.ground_gap_m()
        if not self._first:
            self._first = {name: min(self._kept_m, gap) - CLOSER_M for name, gap in gaps.items()}
        if elapsed_s >= REACHED_AFTER_S:
            return min(gaps.values()) >= self._kept_m
        return all(gap >= self._first[name] for name, gap in gaps.items())


@contextmanager
def world_of(flight: Flight, map: Map, airframe: Airframe) -> Iterator[World]:
    """Yield the bodies of a flight, to measure distances between them; ``map`` has all objects."""
    objects = [
        Body(name=item.name, kind=item.type, parts=OBJECT_TYPES[item.type].parts)
        for item in flight.objects
    ]
    # Nothing moves here, so the friction of the ground does not matter.
    world = make_world(vehicle_model(airframe), map.uav_start_m, map.bodies, objects, 1.0)
    try:
        yield world
    finally:
        world.close()


def escaped(flight: Flight, world: World, from_s: float, until_s: float) -> bool:
    """Return whether a flight keeps its distance from one time to another, and hovers then."""
    return _along(flight, from_s, until_s, Clearance(world).holds)


def poses_at(flight: Flight, index: int) -> list[ObjectPose]:
    """Return where the moving bodies are in a sample of the tracks."""
    found: list[ObjectPose] = []
    for item in flight.objects:
        x, y, z = (float(value) for value in item.track.position_m[index])
        _, _, sine, cosine = (float(value) for value in item.track.attitude[index])
        found.append((item.name, (x, y, z), 2 * math.atan2(sine, cosine)))
    return found


def _along(
    flight: Flight,
    from_s: float,
    until_s: float,
    holds: Callable[[float, Vector, Quaternion, Sequence[ObjectPose]], bool],
) -> bool:
    track = flight.uav
    if flight.elapsed_s < until_s - 1e-6:
        return False
    first = int(np.searchsorted(track.time_s, from_s - 1e-6))
    last = int(np.searchsorted(track.time_s, until_s + 1e-6, side="right"))
    for index in range(first, last):
        x, y, z = (float(value) for value in track.position_m[index])
        qx, qy, qz, qw = (float(value) for value in track.attitude[index])
        elapsed_s = float(track.time_s[index]) - from_s
        if not holds(elapsed_s, (x, y, z), (qx, qy, qz, qw), poses_at(flight, index)):
            return False
    qx, qy, _, _ = (float(value) for value in track.attitude[max(0, last - 1)])
    return first < last and 1 - 2 * (qx * qx + qy * qy) > math.cos(LAST_TILT_RAD)
