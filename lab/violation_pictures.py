"""Draw a sequence of pictures for each type of violation: ``python -m lab.violation_pictures``.

Each is a saved case, or a scenario that was found, flown again: what the camera saw, with what the
landing system reported, as in the paper's figure of violations.  Two more are of MM-MLS while the
UAV holds its place, as in the paper's figure of real flights.  They lie in
``docs/results/pictures``.
"""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import cv2
import numpy as np

from landing_systems.mm_mls import MultiModuleLandingSystem
from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.airframe import Camera
from pytest_garl.cli.named_flight import FlightName
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import airframe_of
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.reports.film.camera_pane import HEIGHT, WIDTH
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.flight_video import frames
from pytest_garl.scenarios.files import load
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits, default_distance_m

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "results" / "pictures"
CASES = ROOT / "scenarios" / "regressions"
SEQUENCES = MappingProxyType(
    {
        "type-I": ("tphyolo_mls/lawn-I-decoy_same_id_without_margin-510fef.toml", 12.0),
        "type-II": ("opencv_mls/court-II-never_seen-0ad334.toml", 36.0),
        "type-IV": ("tphyolo_mls/lawn-IV-dog-fdbc7b.toml", 2.4),
    }
)
"""The case of each sequence, and how many of its last seconds are shown."""
FOUND = MappingProxyType({"type-III": ("found/tree.toml", OpenCvLandingSystem, 6.0)})
"""The same of scenarios that were found and are no saved cases: file and landing system."""
HELD = MappingProxyType({"dog": 7.6, "person": 20.0})
"""The scenarios in which the UAV holds its place, and the second that is drawn."""
PICTURES = 5
SIZE_PX = (256, 192)
"""Width and height of a picture."""
QUALITY = 80
"""Of the JPEG files, of 100."""


class Scene(NamedTuple):
    """A flight, and what draws it."""

    flight: Flight
    placed: Placed
    camera: Camera
    signature: str


def of_case(case: str) -> Scene:
    """Return the flight of a saved case."""
    file = CASES / case
    named = FlightName(
        flight=str(file), ledger=None, scenario=None, system=None, folder=CASES
    ).find(pictures=True)
    place = named.place
    assert place is not None
    assert place.camera is not None
    return Scene(named.flight, place.placed, place.camera, named.signature)


def of_scenario(file: str, system: type) -> Scene:
    """Return the flight of a landing system in a scenario of a file below ``scenarios``."""
    scenario = load(ROOT / "scenarios" / file)
    flight = fly(scenario, system, policy_spec("graded"))
    limits = Limits(distance_m=default_distance_m(scenario.task.marker.side_m))
    camera = airframe_of(system).camera
    placed = Placed(scenario, load_map(scenario.map))
    return Scene(flight, placed, camera, judge(flight, limits).signature)


def sequence(scene: Scene, last_s: float) -> Image:
    """Return ``PICTURES`` views of the camera side by side, evenly spaced over the last seconds."""
    flight = scene.flight
    times = np.array([step.time_s for step in flight.steps])
    wanted = np.linspace(flight.elapsed_s - last_s, times[-1], PICTURES)
    chosen = {int(np.abs(times - each).argmin()) for each in wanted}
    first = min(chosen)
    drawn = frames(*scene, last_s=flight.elapsed_s - times[first])
    views = []
    for index, picture in enumerate(drawn, start=first):
        if index in chosen:
            view = cv2.resize(picture[:HEIGHT, :WIDTH], SIZE_PX, interpolation=cv2.INTER_AREA)
            text = f"{times[index]:.1f} s"
            cv2.putText(view, text, (6, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 3)
            cv2.putText(view, text, (6, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1)
            views.append(view)
        if len(views) == len(chosen):
            break
    return np.hstack(views).astype(np.uint8)


def moment(scene: Scene, time_s: float) -> Image:
    """Return one picture of a film."""
    picture = next(frames(*scene, last_s=scene.flight.elapsed_s - time_s))
    return np.asarray(cv2.resize(picture, None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA))


def main() -> None:
    """Fly the cases and the scenarios, and write docs/results/pictures."""
    for name, time_s in HELD.items():
        scene = of_scenario(f"held/{name}.toml", MultiModuleLandingSystem)
        _write(f"held-{name}", moment(scene, time_s))
    for name, (case, last_s) in SEQUENCES.items():
        _write(name, sequence(of_case(case), last_s))
    for name, (file, system, last_s) in FOUND.items():
        _write(name, sequence(of_scenario(file, system), last_s))


def _write(name: str, picture: Image) -> None:
    path = FOLDER / f"{name}.jpg"
    colours = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    cv2.imwrite(str(path), colours, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
