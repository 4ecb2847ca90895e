"""The pictures that a landing system was shown, drawn again from the record of its flight.

A record says when the landing system got each picture.  When the picture was taken follows from the
scenario, whose delays are a function of its seed.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.distortion import distorted
from pytest_garl.flight.flight import TRACK_RATE_HZ, Flight, Step
from pytest_garl.landing_system import Camera
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.pose import Poses, poses_at
from pytest_garl.reports.mcap.export import Place
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.camera.exposure import Movement
from pytest_garl.simulation.camera.projection import NEAR_M, Quaternion, Vector, View
from pytest_garl.simulation.camera.true_camera import (
    Mounting,
    mount_of,
    product,
    true_camera,
)
from pytest_garl.simulation.environment import environment_at
from pytest_garl.simulation.events import Event
from pytest_garl.simulation.landing_moments import RecordedMoments
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from pytest_garl.simulation.timing import Timing

LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShownPicture:
    """A picture, RGB uint8 (H, W, 3), that was taken at ``time_s``; ``step`` answers it.

    ``outline_px`` (n, 2) is the marker's true outline, also outside of the picture; it is empty if
    the picture does not show the moment at which it was taken, because the camera failed.
    ``eye_m`` is the place of the camera, ``attitude`` that of a UAV on which the declared camera
    would look so.
    """

    time_s: float
    step: Step
    image: Image
    outline_px: NDArray[np.float32]
    eye_m: Vector
    attitude: Quaternion


class ShownPictures:
    """The pictures of one flight; ``camera`` is the camera as it is, not as it is declared."""

    def __init__(self, flight: Flight, place: Place, declared: Camera) -> None:
        self._flight, self._placed = flight, place.placed
        scenario = place.placed.scenario
        self.camera = true_camera(declared, scenario)
        self._mounting = Mounting(scenario)
        self.times_s = taken_s(flight, scenario, declared)

    @property
    def turn(self) -> Quaternion:
        """The turn of the camera on a level UAV: how it is mounted."""
        return product(self._mounting.attitude(LEVEL), mount_of(self.camera))

    def __iter__(self) -> Iterator[ShownPicture]:
        """Draw the pictures one after the other, in the order of time."""
        flight, scenario = self._flight, self._placed.scenario
        moments = RecordedMoments(flight)
        renderer = renderer_of(self._placed, self.camera, moments)
        outage, freezes = Event(scenario, "outage", moments), scenario["outage.frozen"] > 0
        last = black = np.zeros((self.camera.height_px, self.camera.width_px, 3), np.uint8)
        present = scenario
        for time_s, step in zip(self.times_s, flight.steps, strict=True):
            poses = poses_at(flight, time_s)
            attitude, eye = self._mounting.attitude(poses.attitude), poses.eye_m(self.camera)
            outline = np.zeros((0, 2), np.float32)
            if outage.happens(time_s):
                image = last if freezes else black
            else:
                if (now := environment_at(scenario, flight, time_s)) != present:
                    renderer.change(now)
                    present = now
                movement = _movement(flight, poses)
                frame = renderer.render(eye, attitude, time_s, poses.objects, movement)
                image = last = frame.image
                outline = renderer.marker_outline(eye, attitude)
            yield ShownPicture(
                time_s=time_s,
                step=step,
                image=image,
                outline_px=outline,
                eye_m=eye,
                attitude=attitude,
            )

    def pixel_of(self, picture: ShownPicture, place_m: Vector) -> tuple[float, float] | None:
        """Return where a picture shows a place of the world; None for a place behind the camera."""
        view = View.of(self.camera, picture.eye_m, picture.attitude)
        x, y, depth = view.axes @ (np.array(place_m) - view.eye)
        if depth <= NEAR_M:
            return None
        at = np.array([[x / depth, y / depth]])
        if self.camera.distortion:
            at = distorted(at, self.camera.distortion)
        u, v = at[0] * self.camera.focal_px + self.camera.centre_px
        return float(u), float(v)


def taken_s(flight: Flight, scenario: Scenario, camera: Camera) -> tuple[float, ...]:
    """Return when the picture of each step was taken.

    These are the times of the steps if they do not fit the delays of the scenario.
    """
    moments = RecordedMoments(flight)
    under_way, times, over = _Deliveries(scenario, camera, moments), [], False
    for step in flight.steps:
        taken = step.time_s if over else under_way.taken_s(step.time_s)
        if taken is None:
            return tuple(each.time_s for each in flight.steps)
        times.append(taken)
        # After it the simulator goes on looking, and hands over no pictures.
        over = over or step.command == "Abort"
    return tuple(times)


class _Deliveries:
    """The pictures of a flight in the order in which they arrive (``simulation/sensors.py``)."""

    def __init__(self, scenario: Scenario, camera: Camera, moments: RecordedMoments) -> None:
        self._timing = Timing(scenario, moments)
        self._ticks_per_frame = max(1, round(PHYSICS_RATE_HZ / camera.rate_hz))
        self._tick = 0
        self._waiting: deque[tuple[int, int]] = deque()

    def taken_s(self, arrival_s: float) -> float | None:
        """Return when the next picture was taken, None if it does not arrive at this time."""
        wanted = round(arrival_s * PHYSICS_RATE_HZ)
        while not self._waiting and self._tick <= wanted:
            self._take()
        if not self._waiting or self._waiting[0][1] != wanted:
            return None
        return self._waiting.popleft()[0] / PHYSICS_RATE_HZ

    def _take(self) -> None:
        tick, late = self._tick, self._timing.stamp_ticks
        self._tick += self._ticks_per_frame
        if tick + late < 0:
            return
        jitter_ms = self._timing.jitter_ms()
        if jitter_ms is not None:
            self._waiting.append((tick, self._timing.arrival(tick + max(0, late), jitter_ms)))


def _movement(flight: Flight, poses: Poses) -> Movement:
    """Return how the camera moves at a time: the recorded velocity, and the turn of the track."""
    track, half_s = flight.uav, 0.5 / TRACK_RATE_HZ
    vx, vy, vz = (
        float(np.interp(poses.time_s, track.time_s, track.velocity_mps[:, axis]))
        for axis in range(3)
    )
    before, after = (poses_at(flight, poses.time_s + by).attitude for by in (-half_s, half_s))
    return Movement(velocity_mps=(vx, vy, vz), spin_radps=_spin(before, after, 2 * half_s))


def _spin(before: Quaternion, after: Quaternion, seconds: float) -> Vector:
    """Return the angular velocity, in the world's axes, that turns one attitude into another."""
    x, y, z, w = before
    x, y, z, w = product(after, (-x, -y, -z, w))
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-12:
        return 0.0, 0.0, 0.0
    rate = 2 * math.atan2(length, abs(w)) / length / seconds * (1 if w >= 0 else -1)
    return x * rate, y * rate, z * rate
