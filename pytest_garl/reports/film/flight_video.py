"""From a recorded flight to the video's pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pytest_garl.errors import GarlError
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Camera
from pytest_garl.reports.film.camera_pane import CameraPane
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.film_file import write_film
from pytest_garl.reports.film.map_pane import MapPane
from pytest_garl.reports.film.pose import poses_at
from pytest_garl.reports.film.timeline import Timeline
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.environment import environment_at
from pytest_garl.simulation.landing_moments import RecordedMoments

CLOSING_S = 2.0
"""How long the last picture, with the outcome, is shown."""


def save_video(
    path: Path,
    flight: Flight,
    placed: Placed,
    camera: Camera,
    signature: str = "",
    *,
    last_s: float | None = None,
) -> None:
    """Write the video of a flight to ``path``; it plays at the flight's own speed.

    A file .mp4 has the full size, a file .gif half of it.  ``last_s`` shows the last seconds only.
    Raises GarlError where the flight is not one of this scenario, or there is no encoder.
    """
    pictures = frames(flight, placed, camera, signature, last_s=last_s)
    write_film(pictures, path, rate_hz(flight, camera))


def frames(
    flight: Flight,
    placed: Placed,
    camera: Camera,
    signature: str = "",
    *,
    last_s: float | None = None,
) -> Iterator[Image]:
    """Yield the video's pictures, RGB uint8 (656, 1024, 3): one per camera frame, then the end.

    ``camera`` is the one that flew; ``signature`` the verdict's, empty for a flight without
    violation.  ``last_s`` leaves out all frames before the last seconds.  The end is the last
    moment with the outcome, for ``CLOSING_S``.  Raises GarlError where the flight is not one of
    this scenario.
    """
    scenario = placed.scenario
    check_scenario(flight, placed)
    renderer = renderer_of(placed, camera, RecordedMoments(flight))
    left, right = CameraPane(renderer), MapPane(flight, placed, camera)
    below = Timeline(flight, signature)
    shown = scenario
    first_s = -math.inf if last_s is None else flight.elapsed_s - last_s
    for step in flight.steps:
        if step.time_s < first_s:
            continue
        if (now := environment_at(scenario, flight, step.time_s)) != shown:
            renderer.change(now)
            shown = now
        poses = poses_at(flight, step.time_s)
        side = np.vstack([left.draw(poses, step), below.draw(poses, step)])
        yield np.hstack([side, right.draw(poses, step)])
    last, poses = flight.steps[-1] if flight.steps else None, poses_at(flight, flight.elapsed_s)
    side = np.vstack([left.draw(poses, None), below.draw(poses, last, ended=True)])
    picture = np.hstack([side, right.draw(poses, last, ended=True)])
    for _ in range(math.ceil(CLOSING_S * rate_hz(flight, camera))):
        yield picture


def rate_hz(flight: Flight, camera: Camera) -> float:
    """Return the rate of the recorded steps, which the physics rounds from the camera's."""
    if len(flight.steps) < 2:
        return camera.rate_hz
    span = flight.steps[-1].time_s - flight.steps[0].time_s
    return round((len(flight.steps) - 1) / span, 3)


def check_scenario(flight: Flight, placed: Placed) -> None:
    """Raise GarlError where the flight is not one of this scenario."""
    marker, map = placed.marker_m, placed.map
    if math.dist(marker, flight.marker_position_m) > 1e-6:
        x, y = flight.marker_position_m
        raise GarlError(
            f"this flight is not of this scenario: its marker lay at ({x:.2f}, {y:.2f}), the "
            f"scenario's lies at ({marker[0]:.2f}, {marker[1]:.2f}) on map {map.name!r}; "
            "take the scenario and the map that were flown"
        )
    flown, listed = (
        [item.name for item in flight.objects],
        [name for name, _ in map.present_objects],
    )
    if flown != listed:
        raise GarlError(
            f"this flight is not of this scenario: it has the objects {', '.join(flown) or 'none'}"
            f", map {map.name!r} has {', '.join(listed) or 'none'}; take the scenario and the map "
            "that were flown"
        )
