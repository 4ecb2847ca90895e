"""Draw the contact sheets of docs/weather.md: both maps, each gene, from 10 m and from 2.5 m."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera.renderer import Renderer

COLUMNS = 6
VIEW_PX = (140, 105)
"""Width and height of a view in a sheet."""


def sheet(name: str) -> np.ndarray:
    """Return one map's sheet: each cell is the view from 10 m over that from 2.5 m."""
    map = load_map(name)
    genome = genome_for(map, weather="full")
    clear = decode(genome.nominal, genome, map=name, seed=1)
    clear = repair(clear.replace({"marker.x": 0.3, "marker.y": -0.2}), map)
    weather = [key for key in genome.keys if key.startswith("environment.")][:-1]
    changes: list[dict[str, float]] = [{}]
    changes += [{key: value} for key in weather for value in (0.15, 1.0)]
    changes += [{"environment.sun_position": value} for value in (0.0, 0.05, 0.12)]
    cells = []
    for change in changes:
        renderer = Renderer(Placed(clear.replace(change), map), Camera(), np.random.default_rng(0))
        x, y = renderer.marker_m
        objects = [((x + 1.3, y + 0.9, 0.0), 0.5), ((x - 3.0, y + 1.0, 0.0), 2.5)]
        objects += [((x + 0.9, y - 1.2, 3.0), 1.0), ((x - 1.5, y - 0.6, 0.0), 0.2)]
        views = []
        for height in (10.0, 2.5):
            frame = renderer.render((x - 0.2, y + 0.1, height), (0, 0, 0, 1), 1.0, objects)
            views.append(cv2.resize(frame.image, VIEW_PX, interpolation=cv2.INTER_AREA))
        cell = np.vstack(views)
        label = (
            " ".join(f"{key.split('.')[1]} {value:g}" for key, value in change.items()) or "clear"
        )
        cv2.putText(cell, label, (3, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.3, (255, 40, 40))
        cells.append(np.asarray(cell, np.uint8))
    while len(cells) % COLUMNS:
        cells.append(np.full_like(cells[0], 255))
    rows = [np.hstack(cells[i : i + COLUMNS]) for i in range(0, len(cells), COLUMNS)]
    return np.vstack(rows)


def main() -> None:
    """Write docs/pictures/<map>.png."""
    folder = Path(__file__).parents[1] / "docs" / "pictures"
    folder.mkdir(exist_ok=True)
    for name in ("court", "lawn"):
        picture = cv2.cvtColor(sheet(name) & 0xF8, cv2.COLOR_RGB2BGR)  # Five bits compress better.
        cv2.imwrite(str(folder / f"{name}.png"), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
