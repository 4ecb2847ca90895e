"""Picture of the weather: the marker at the end of each range of the domain ``field``."""

from __future__ import annotations

import math
from pathlib import Path

from pytest_garl.cli.domain import range_in_words
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.units import WEATHER_UNITS
from studies.conditions._frames import WatchesSeldom, draw_frames, seen_at, watched
from tests.support.flights import nominal


def draw(folder: Path) -> None:
    """Draw ``weather.png``."""
    field, frames = domain_named("field"), []
    _, seen = watched(nominal(), 16.0, WatchesSeldom)
    frames.append(("clear", seen_at(seen, 15.0)))
    for key, unit in WEATHER_UNITS.items():
        limits = field.range_of(f"weather.{unit.name}")
        if limits is None:
            continue
        end = limits[0] if math.isinf(limits[1]) else limits[1]
        _, seen = watched(nominal().replace({key: unit.gene(end)}), 16.0, WatchesSeldom)
        title = unit.name.rpartition("_")[0].removesuffix("_per").replace("_", " ")
        words = range_in_words(unit.name, end, end).removeprefix("always ")
        frames.append((f"{title}: {words}", seen_at(seen, 15.0)))
    draw_frames(folder / "weather.png", frames, 5)
