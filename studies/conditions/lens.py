"""Picture of a lens that distorts, beside a pinhole."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from tests.support.flights import nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)
LENSES = {"pinhole": (), "k1 = -0.28, k2 = 0.08": (-0.28, 0.08, 0.0, 0.0)}


def draw(folder: Path) -> None:
    """Draw ``lens.png``."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(6.4, 2.6), constrained_layout=True)
    for axis, (title, lens) in zip(axes.flat, LENSES.items(), strict=True):
        scenario, camera = nominal(), Camera(distortion=lens)
        renderer = Renderer(scenario, load_map("court"), camera, generator(1, "sensor"))
        x, y = renderer.marker_m
        far_away = [((50.0, 50.0, 0.0), 0.0)] * len(load_map("court").present_objects)
        place = eye_under((x + 2.0, y + 2.0, 6.0), LEVEL)
        axis.imshow(renderer.render(place, LEVEL, 0.0, far_away).image)
        axis.set_title(title, fontsize="small")
        axis.set(xticks=[], yticks=[])
    figure.savefig(folder / "lens.png", dpi=50)
    pyplot.close(figure)
