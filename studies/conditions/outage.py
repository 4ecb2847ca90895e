"""Picture of an outage: frames before, during and after it, black and frozen."""

from __future__ import annotations

from pathlib import Path

from studies.conditions._frames import draw_frames, seen_at, watched
from tests.support.flights import nominal

FROM_S, LASTS_S = 5.0, 3.0
TIMES_S = (4.5, 5.5, 7.5, 8.5)


def draw(folder: Path) -> None:
    """Draw ``outage.png``."""
    frames = []
    for frozen in (0.0, 1.0):
        _, seen = watched(
            nominal(outage__from_s=FROM_S, outage__lasts_s=LASTS_S, outage__frozen=frozen), 9.0
        )
        frames += [(f"frozen = {frozen:g}, {time:g} s", seen_at(seen, time)) for time in TIMES_S]
    draw_frames(folder / "outage.png", frames, len(TIMES_S))
