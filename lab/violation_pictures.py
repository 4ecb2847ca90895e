"""Draw a sequence of pictures for each type of violation: ``python -m lab.violation_pictures``.

Each is a saved case, flown again: what the camera saw, with what the landing system reported, as in
the paper's figure of violations.  They lie in ``docs/results/pictures``.
"""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np

from pytest_garl import cpu_dispatch
from pytest_garl.cli.named_flight import FlightName, NamedFlight
from pytest_garl.reports.film.camera_pane import HEIGHT, WIDTH
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.flight_video import frames

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


def main() -> None:
    """Fly the cases and write docs/results/pictures/type-*.jpg."""
    cpu_dispatch.pin()
    for name, (case, last_s) in SEQUENCES.items():
        file = CASES / case
        named = FlightName(
            flight=str(file), ledger=None, scenario=None, system=None, folder=CASES
        ).find(pictures=True)
        picture = cv2.cvtColor(sequence(named, last_s), cv2.COLOR_RGB2BGR)
        path = FOLDER / f"{name}.jpg"
        cv2.imwrite(str(path), picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        print(f"{path.relative_to(ROOT)}: {named.signature}, {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
