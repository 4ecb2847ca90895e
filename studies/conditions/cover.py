"""Picture of the cover: the marker before, while and after a tarpaulin lies over a part of it."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.cover_event import renderer_of
from studies.conditions._frames import draw_frames
from tests.support.flights import EMPTY, nominal

HEIGHT_M = 4.0
LEVEL = (0.0, 0.0, 0.0, 1.0)


def draw(folder: Path) -> None:
    """Draw ``cover.png``."""
    frames = []
    for time_s, share in ((9.0, 10.0), (10.0, 10.0), (12.0, 40.0), (14.0, 100.0), (15.0, 100.0)):
        event = {"cover__from_s": 10.0, "cover__lasts_s": 5.0, "cover__share_percent": share}
        renderer = renderer_of(nominal(**event), EMPTY, Camera())
        x, y = renderer.marker_m
        image = renderer.render((x, y, HEIGHT_M), LEVEL, time_s, []).image
        frames.append((f"{time_s:g} s, {share:g} %", image))
    draw_frames(folder / "cover.png", frames, len(frames))
