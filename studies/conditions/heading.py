"""Picture of the heading: the same place seen with other headings at the start."""

from __future__ import annotations

from pathlib import Path

from studies.conditions._frames import WatchesSeldom, draw_frames, seen_at, watched
from tests.support.flights import nominal

HEADINGS_DEG = (0.0, 45.0, 90.0, -135.0)


def draw(folder: Path) -> None:
    """Draw ``heading.png``."""
    frames = []
    for heading in HEADINGS_DEG:
        _, seen = watched(nominal(heading__start_deg=heading), 16.0, WatchesSeldom)
        frames.append((f"start_deg = {heading:g}", seen_at(seen, 15.0)))
    draw_frames(folder / "heading.png", frames, len(frames))
