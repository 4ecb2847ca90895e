"""Picture of the decoys: each kind beside the marker, on both maps."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.groups.decoys import KINDS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from studies.conditions._frames import draw_frames

HEIGHT_M = 6.0
ASIDE_M = 2.4
LEVEL = (0.0, 0.0, 0.0, 1.0)


def draw(folder: Path) -> None:
    """Draw ``decoys.png``."""
    frames = []
    for name in ("court", "lawn"):
        map = dataclasses.replace(load_map(name), objects=())
        genome = genome_for(map)
        east, north = map.gps_position_m
        for number, kind in enumerate(KINDS[1:], start=1):
            nominal = decode(np.array(genome.nominal, float), genome, map=name, seed=1)
            values = {
                "decoy-1.kind": float(number),
                "decoy-1.y_m": ASIDE_M,
                "decoy-1.yaw_deg": 20.0,
            }
            scenario = nominal.replace(values)
            renderer = Renderer(scenario, map, Camera(), generator(1, "sensor"))
            eye = (east, north + ASIDE_M / 2, HEIGHT_M)
            frames.append((kind, renderer.render(eye, LEVEL, 0.0, []).image))
    draw_frames(folder / "decoys.png", frames, len(KINDS) - 1)
