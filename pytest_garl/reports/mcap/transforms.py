"""The topic ``/tf``: where the UAV, its camera and the objects are, at each sample and picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from foxglove.messages import FrameTransform, FrameTransforms
from numpy.typing import NDArray

from pytest_garl.airframe import BELLY_M
from pytest_garl.flight.flight import Flight, Track
from pytest_garl.reports.mcap.values import (
    CAMERA_FRAME,
    IDENTITY,
    UAV_FRAME,
    WORLD,
    Logged,
    ns,
    quaternion,
    stamp,
    vector,
)
from pytest_garl.simulation.camera.projection import Quaternion, Vector
from pytest_garl.simulation.camera.true_camera import product

TOPIC = "/tf"
OPTICAL: Quaternion = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)
"""Turns the optical frame (x right, y down, z forward) into the body (x forward, y left, z up) of a
UAV whose camera looks down: right is the body's -y, down its -x, forward its -z."""
Array = NDArray[np.float64]


def transforms(
    flight: Flight,
    pictures_s: Sequence[float],
    camera_turn: Quaternion | None,
    camera_m: Vector = BELLY_M,
) -> Iterator[Logged]:
    """Yield all transforms at each sample of the tracks and at each picture.

    ``camera_turn`` is how the camera is mounted on the UAV, and ``camera_m`` where; the turn is
    None for a flight without a camera.
    Each message holds all frames, so that a viewer that jumps to a time needs only one.
    """
    names = [UAV_FRAME, *(item.name for item in flight.objects)]
    times_s = _times_s(flight, pictures_s)
    tracks = [sampled(track, times_s) for track in (flight.uav, *(o.track for o in flight.objects))]
    for index, time_s in enumerate(times_s.tolist()):
        time_ns = ns(time_s)
        found = [
            _transform(time_ns, WORLD, name, places[index], attitudes[index])
            for name, (places, attitudes) in zip(names, tracks, strict=True)
        ]
        if camera_turn is not None:
            turn = product(camera_turn, OPTICAL)
            found.append(_transform(time_ns, UAV_FRAME, CAMERA_FRAME, camera_m, turn))
        yield Logged(time_ns=time_ns, topic=TOPIC, message=FrameTransforms(transforms=found))


def _times_s(flight: Flight, pictures_s: Sequence[float]) -> Array:
    """Return the times of samples and pictures in order, each nanosecond once."""
    times_s = np.concatenate([flight.uav.time_s, np.array(pictures_s, np.float64)])
    _, first = np.unique(np.round(times_s * 1e9), return_index=True)
    return np.asarray(times_s[first], np.float64)


def _transform(
    time_ns: int,
    parent: str,
    child: str,
    place_m: Sequence[float] | Array,
    turn: Sequence[float] | Array,
) -> FrameTransform:
    return FrameTransform(
        timestamp=stamp(time_ns),
        parent_frame_id=parent,
        child_frame_id=child,
        translation=vector(place_m),
        rotation=quaternion(turn),
    )


def sampled(track: Track, times_s: Array) -> tuple[Array, Array]:
    """Return positions (n, 3) and attitudes (n, 4) of a track at times within it.

    Between samples positions change linearly and attitudes along the shorter turn, as in
    ``film/pose.py``.  A simulator that records no attitudes has zeros, which become level.
    """
    positions = np.stack([np.interp(times_s, track.time_s, part) for part in track.position_m.T], 1)
    attitudes = track.attitude.copy()
    attitudes[~attitudes.any(axis=1)] = IDENTITY
    # A quaternion and its negative are the same attitude; neighbours get the same sign.
    turns_back = np.einsum("ij,ij->i", attitudes[1:], attitudes[:-1]) < 0
    attitudes[1:][np.cumsum(turns_back) % 2 == 1] *= -1
    mixed = np.stack([np.interp(times_s, track.time_s, part) for part in attitudes.T], 1)
    return positions, mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
