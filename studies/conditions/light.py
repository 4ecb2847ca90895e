"""Picture of the light: the marker under the sun at elevations from noon to dusk."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.scenarios.genes import SUN
from pytest_garl.scenarios.light import position_of_elevation
from studies.conditions._frames import WatchesSeldom, draw_frames, seen_at, watched
from tests.support.flights import nominal

ELEVATIONS_DEG = (60.0, 30.0, 10.0, 5.0, 0.0, -3.0, -4.5, -6.0)


def draw(folder: Path) -> None:
    """Draw ``light.png``."""
    frames = []
    for elevation in ELEVATIONS_DEG:
        scenario = nominal().replace({SUN: position_of_elevation(elevation)})
        _, seen = watched(scenario, 16.0, WatchesSeldom)
        image = seen_at(seen, 15.0)
        print(f"{elevation:g} degrees: mean {image.mean():.0f}, deviation {image.std():.0f}")
        frames.append((f"sun at {elevation:g} degrees", image))
    draw_frames(folder / "light.png", frames, 4)
