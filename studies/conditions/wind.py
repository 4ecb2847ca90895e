"""Picture of the wind: its profile, what a hovering UAV meets, and how far it is moved."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pytest_garl.scenarios.maps.map import Texture
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.physics.wind import Wind, mean_wind
from tests.support.flights import EMPTY, STAND, Scripted, nominal

MEAN_MPS = 6.0
HEIGHT_M = 10.0
SECONDS = 60.0


class HoversAtCruise(Scripted):
    """Holds its place at the cruise height by the simulator's own flight control."""

    def step(self, observation: object) -> object:
        """Stay above home."""
        return self.hover(HEIGHT_M)


def draw(folder: Path) -> None:
    """Draw ``wind.png``."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, middle, right) = pyplot.subplots(
        1, 3, figsize=(11.0, 3.4), constrained_layout=True
    )
    heights_m = np.linspace(0.2, 12.0, 100)
    grounds: tuple[Texture, ...] = ("grass", "concrete")
    for ground in grounds:
        mean = mean_wind(nominal(wind__mean_mps=MEAN_MPS), ground)
        left.plot([mean.at(float(height))[0] for height in heights_m], heights_m, label=ground)
    left.axhline(6.0, color="k", linewidth=0.6, linestyle=":")
    left.set(title="mean wind", xlabel="m/s", ylabel="height (m)", xlim=(0, 8))
    left.legend()
    for turbulence in (1.0, 0.0):
        scenario = nominal(wind__mean_mps=MEAN_MPS, wind__turbulence=turbulence)
        wind = Wind(scenario, "grass")
        ticks = range(round(SECONDS * 240))
        place, still = (0.0, 0.0, HEIGHT_M), (0.0, 0.0, 0.0)
        met = np.array([wind.velocity_mps(tick, place, still) for tick in ticks])
        names = ("along", "across", "up") if turbulence else ("mean",)
        for axis, name in enumerate(names):
            style = {"linewidth": 0.8} if turbulence else {"color": "k", "linestyle": ":"}
            middle.plot(np.array(ticks) / 240, met[:, axis], label=name, **style)
    middle.set(title=f"wind at {HEIGHT_M:g} m, turbulence 1", xlabel="time (s)", ylabel="m/s")
    middle.legend(fontsize="small", ncols=2)
    for turbulence in (0.0, 1.0, 1.5):
        scenario = nominal(wind__mean_mps=MEAN_MPS, wind__turbulence=turbulence)
        flight = fly(scenario, HoversAtCruise, STAND, map=EMPTY, time_limit_s=SECONDS)
        away = flight.uav.position_m - np.array([*EMPTY.uav_start_m[:2], HEIGHT_M])
        late = flight.uav.time_s > 12.0
        right.plot(away[late, 0], away[late, 1], linewidth=0.8, label=f"turbulence {turbulence:g}")
        print(f"turbulence {turbulence:g}: off by at most {np.abs(away[late]).max(axis=0)} m")
    right.set(title="a hovering UAV", xlabel="east (m)", ylabel="north (m)")
    right.axis("equal")
    right.legend(fontsize="small")
    figure.savefig(folder / "wind.png", dpi=80)
    pyplot.close(figure)
