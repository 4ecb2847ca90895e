"""Picture of the pad: a marker that is turned, more and more worn, and near a tree."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from studies.conditions._frames import draw_frames
from tests.support.flights import EMPTY, nominal

HEIGHT_M = 4.0
LEVEL = (0.0, 0.0, 0.0, 1.0)


def draw(folder: Path) -> None:
    """Draw ``pad.png``."""
    frames = []
    for title, genes in (
        ("clean", {}),
        ("yaw_deg = 40", {"pad__yaw_deg": 40.0}),
        ("worn_percent = 10", {"pad__worn_percent": 10.0}),
        ("worn_percent = 20", {"pad__worn_percent": 20.0}),
    ):
        scenario = nominal(**genes)
        renderer = Renderer(scenario, EMPTY, Camera(), generator(scenario.seed, "sensor"))
        x, y = renderer.marker_m
        frames.append((title, renderer.render((x, y, HEIGHT_M), LEVEL, 0.0, []).image))
    draw_frames(folder / "pad.png", frames, len(frames))
