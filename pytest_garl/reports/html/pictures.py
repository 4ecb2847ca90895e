"""Pictures of a flight: what the camera saw at its moments, and the film."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from pytest_garl.flight.detectability import readable_probability
from pytest_garl.flight.flight import Flight, Step
from pytest_garl.landing_system import Camera
from pytest_garl.reports.film import frames, rate_hz, write
from pytest_garl.reports.film.camera_pane import CameraPane
from pytest_garl.reports.film.encoder import TOP_KBPS
from pytest_garl.reports.film.flight_video import CLOSING_S
from pytest_garl.reports.film.pose import poses_at
from pytest_garl.reports.html.moments import Moment, telling_moment
from pytest_garl.reports.html.turnable_path import jpeg_uri
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.environment import environment_at
from pytest_garl.verdicts.evidence import Evidence

STILL_PX = (400, 300)
STILL_QUALITY = 76
THUMBNAIL_PX = (160, 120)
THUMBNAIL_QUALITY = 60
FILM_BYTES = 1_000_000
"""A page has 2 MB at most; base64 makes a third more of a film, and the rest is half a megabyte."""
_BUFFER_S = 4.0
"""Films may be longer by this time of their rate: the buffer of the encoder."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Still:
    """What the camera saw at a moment: the picture's address, and facts in words."""

    time_s: float
    label: str
    picture: str
    facts: tuple[str, ...]
    shows_cause: bool = False
    """Whether it shows best why its flight ended so: it stands for its kind."""


def stills_of(
    evidence: Evidence, scenario: Scenario, renderer: Renderer, moments: Sequence[Moment]
) -> tuple[tuple[Still, ...], str]:
    """Return the pictures at the moments, and a small one of the moment that shows the cause.

    A picture is that of the last frame up to its moment.  The marker is outlined.
    """
    pane, shown = CameraPane(renderer), scenario
    found, small = [], ""
    flight, shows = evidence.flight, telling_moment(evidence, moments)
    for moment in moments:
        step = _step_at(flight.steps, moment.time_s)
        time_s = step.time_s if step else moment.time_s
        if (now := environment_at(scenario, flight, time_s)) != shown:
            renderer.change(now)
            shown = now
        drawn = pane.draw(poses_at(flight, time_s), step)
        picture = np.asarray(cv2.resize(drawn, STILL_PX, interpolation=cv2.INTER_AREA), np.uint8)
        uri = jpeg_uri(picture, STILL_QUALITY)
        found.append(
            Still(
                time_s=moment.time_s,
                label=moment.label,
                picture=uri,
                facts=tuple(_facts(step)),
                shows_cause=moment is shows,
            )
        )
        if moment is shows:
            least = cv2.resize(drawn, THUMBNAIL_PX, interpolation=cv2.INTER_AREA)
            small = jpeg_uri(np.asarray(least, np.uint8), THUMBNAIL_QUALITY)
    return tuple(found), small


def _step_at(steps: Sequence[Step], time_s: float) -> Step | None:
    return next((step for step in reversed(steps) if step.time_s <= time_s + 1e-6), None)


def _facts(step: Step | None) -> Iterator[str]:
    if step is None:
        return
    if step.marker_visible <= 0:
        yield "marker not in the picture"
    elif step.marker is not None:
        yield f"chance to read the marker {100 * readable_probability(step.marker):.0f} %"
    else:
        yield f"{100 * step.marker_visible:.0f} % of the marker unhidden"
    seen = step.diagnostics.detections if step.diagnostics else ()
    if seen:
        yield f"the system reports {len(seen)} marker{'s' if len(seen) > 1 else ''}"
    if step.objects_visible:
        yield f"in view: {', '.join(step.objects_visible)}"


def film_of(flight: Flight, placed: Placed, camera: Camera, signature: str) -> bytes:
    """Return the film of a flight, which plays at its own speed, small enough for a page.

    Raises GarlError if there is no encoder.
    """
    rate = rate_hz(flight, camera)
    shown_s = len(flight.steps) / rate + CLOSING_S + _BUFFER_S
    kbps = min(TOP_KBPS, int(8 * FILM_BYTES / 1000 / shown_s))
    with tempfile.TemporaryDirectory(prefix="garl-film-") as folder:
        path = Path(folder) / "film.mp4"
        write(frames(flight, placed, camera, signature), path, rate, top_kbps=kbps)
        return path.read_bytes()


def picture_bytes(address: str) -> bytes:
    """Return the file of a picture that a page holds itself."""
    return base64.b64decode(address.partition(",")[2])


def film_uri(film: bytes) -> str:
    """Return the address of a film that a page holds itself."""
    return f"data:video/mp4;base64,{base64.b64encode(film).decode()}"
