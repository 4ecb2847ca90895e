"""Draw a sequence of pictures for each type of violation: ``python -m lab.violation_pictures``.

Each is a saved case, flown again: what the camera saw, with what the landing system reported, as in
the paper's figure of violations.  Two more are of MM-MLS while the UAV holds its place, as in the
paper's figure of real flights.  They lie in ``docs/results/pictures``.
"""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np

from landing_systems.mm_mls import MultiModuleLandingSystem
from pytest_garl import cpu_dispatch
from pytest_garl.cli.named_flight import FlightName, NamedFlight
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
HELD = MappingProxyType({"dog": 7.6, "person": 20.0})
"""The scenarios in which the UAV holds its place, and the second that is drawn."""
PICTURES = 5
SIZE_PX = (256, 192)
"""Width and height of a picture."""
QUALITY = 80
"""Of the JPEG files, of 100."""


def sequence(named: NamedFlight, last_s: float) -> Image:
    """Return ``PICTURES`` views of the camera side by side, evenly spaced over the last seconds."""
    flight, place = named.flight, named.place
    assert place is not None
    assert place.camera is not None
    times = np.array([step.time_s for step in flight.steps])
    wanted = np.linspace(flight.elapsed_s - last_s, times[-1], PICTURES)
    chosen = {int(np.abs(times - each).argmin()) for each in wanted}
    first = min(chosen)
    drawn = frames(
        flight, place.placed, place.camera, named.signature, last_s=flight.elapsed_s - times[first]
    )
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


def held(name: str, time_s: float) -> Image:
    """Return a moment of a flight in which MM-MLS plans and the UAV holds its place."""
    scenario = load(ROOT / "scenarios" / "held" / f"{name}.toml")
    flight = fly(scenario, MultiModuleLandingSystem, policy_spec("graded"))
    limits = Limits(distance_m=default_distance_m(scenario.task.marker.side_m))
    drawn = frames(
        flight,
        Placed(scenario, load_map(scenario.map)),
        MultiModuleLandingSystem.airframe.camera,
        judge(flight, limits).signature,
        last_s=flight.elapsed_s - time_s,
    )
    return np.asarray(cv2.resize(next(drawn), None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA))


def main() -> None:
    """Fly the cases and the scenarios, and write docs/results/pictures."""
    cpu_dispatch.pin()
    for scenario, time_s in HELD.items():
        _write(f"held-{scenario}", held(scenario, time_s))
    for name, (case, last_s) in SEQUENCES.items():
        file = CASES / case
        named = FlightName(
            flight=str(file), ledger=None, scenario=None, system=None, folder=CASES
        ).find(pictures=True)
        _write(name, sequence(named, last_s))


def _write(name: str, picture: Image) -> None:
    path = FOLDER / f"{name}.jpg"
    colours = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    cv2.imwrite(str(path), colours, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
