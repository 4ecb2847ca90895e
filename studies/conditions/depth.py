"""Picture of the depth group: what the depth camera measures, and its reach in fog."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.depth_sensor import DepthSensor, reach_m
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.camera.weather import KOSCHMIEDER
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

PLACE_M, LEVEL = (6.0, 5.0, 8.0), (0.0, 0.0, 0.0, 1.0)
CASES = {
    "no limit, no holes": {},
    "range_m = 8": {"depth__range_m": 8.0},
    "holes_percent = 30": {"depth__holes_percent": 30.0},
}


def draw(folder: Path) -> None:
    """Draw ``depth.png``."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 4, figsize=(11.0, 2.8), constrained_layout=True)
    camera = Camera()
    for axis, (title, values) in zip(axes, CASES.items(), strict=False):
        scenario = nominal(**values)
        renderer = Renderer(
            scenario, EMPTY, camera, generator(scenario.seed, "sensor"), colour=False
        )
        frame = renderer.render(eye_under(PLACE_M, LEVEL), LEVEL, 0.0, [])
        depth = DepthSensor(scenario, camera).measured(frame.depth_m, 0.0)
        image = axis.imshow(np.ma.masked_equal(depth, 0.0), vmin=3.0, vmax=9.0)
        axis.set(title=title, xticks=[], yticks=[])
        axis.set_facecolor("black")
        print(f"{title}: {np.mean(depth == 0):.1%} without a measurement")
    figure.colorbar(image, ax=axes[:3], label="depth (m); black: 0", shrink=0.8)
    visibilities_m = np.geomspace(30.0, 2000.0, 100)
    for clear_m in (6.0, 10.0, 20.0):
        reach = [reach_m(clear_m, KOSCHMIEDER / each) for each in visibilities_m]
        axes[3].semilogx(visibilities_m, reach, label=f"range_m = {clear_m:g}")
    axes[3].set(title="reach", xlabel="visibility (m)", ylabel="m", ylim=(0, None))
    axes[3].legend(fontsize="small")
    figure.savefig(folder / "depth.png", dpi=80)
    pyplot.close(figure)
