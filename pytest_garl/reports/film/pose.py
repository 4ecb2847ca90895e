"""Poses of the UAV and of all objects at one time of a recorded flight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight, Track
from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.projection import Quaternion, Vector, eye_under
from pytest_garl.simulation.camera.solids import BodyPose


@dataclass(frozen=True, slots=True, kw_only=True)
class Poses:
    """Poses at one time: the UAV's, and (position, yaw) of each object."""

    time_s: float
    position_m: Vector
    attitude: Quaternion
    objects: tuple[BodyPose, ...]

    def eye_m(self, camera: Camera) -> Vector:
        """Return the place of the UAV's camera."""
        return eye_under(self.position_m, self.attitude, camera.offset_m)


def poses_at(flight: Flight, time_s: float) -> Poses:
    """Interpolate the recorded tracks: positions linearly, attitudes along the shorter turn."""
    position, attitude = _pose(flight.uav, time_s)
    objects = []
    for item in flight.objects:
        place, (_, _, z, w) = _pose(item.track, time_s)
        objects.append((place, 2 * math.atan2(z, w)))
    return Poses(
        time_s=time_s,
        position_m=position,
        attitude=attitude,
        objects=tuple(objects),
    )


def path_until(track: Track, time_s: float) -> NDArray[np.float64]:
    """Return the positions (n, 3) of a track from its start to ``time_s``."""
    past = track.position_m[track.time_s < time_s]
    return np.vstack([past, _pose(track, time_s)[0]])


def _pose(track: Track, time_s: float) -> tuple[Vector, Quaternion]:
    times = track.time_s
    after = min(int(np.searchsorted(times, time_s, side="right")), len(times) - 1)
    before = max(0, after - 1)
    span = float(times[after] - times[before])
    share = min(1.0, max(0.0, (time_s - float(times[before])) / span)) if span > 0 else 0.0
    x, y, z = _between(track.position_m[before], track.position_m[after], share)
    start, end = track.attitude[before], track.attitude[after]
    # A quaternion and its negative are the same attitude; the nearer one is the shorter turn.
    mixed = _between(start, end if start @ end >= 0 else -end, share)
    a, b, c, d = mixed / np.linalg.norm(mixed)
    return (float(x), float(y), float(z)), (float(a), float(b), float(c), float(d))


def _between(
    start: NDArray[np.float64], end: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    return (1 - share) * start + share * end
