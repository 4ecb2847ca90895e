"""Picture of the navigation error: the error over time, and a UAV that holds its place by it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.navigation import Navigation
from pytest_garl.simulation.physics.vehicle import Motion
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from tests.support.flights import EMPTY, STAND, Scripted, nominal

SECONDS = 90.0
HEIGHT_M = 10.0
FIELD = {
    "navigation__position_m": 2.5,
    "navigation__height_m": 0.5,
    "navigation__yaw_deg": 8.0,
    "navigation__tilt_deg": 2.0,
    "navigation__correlation_s": 60.0,
}
JUMP = {"jump__from_s": 40.0, "jump__distance_m": 3.0, "jump__towards_deg": 90.0}


class HoldsItsPlace(Scripted):
    """Holds its place at the cruise height, as it believes."""

    def step(self, observation: object) -> object:
        """Stay above home."""
        return self.hover(HEIGHT_M)


def draw(folder: Path) -> None:
    """Draw ``navigation.png``."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, middle, right) = pyplot.subplots(
        1, 3, figsize=(11.0, 3.4), constrained_layout=True
    )
    rest = Motion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    ticks = range(round(SECONDS * PHYSICS_RATE_HZ))
    times = np.array(ticks) / PHYSICS_RATE_HZ
    for seed in range(4):
        navigation = Navigation(dataclasses.replace(nominal(**FIELD, **JUMP), seed=seed))
        said = [navigation.estimate(tick, rest) for tick in ticks]
        places = np.array([each.position_m for each in said])
        left.plot(times, places[:, 0], linewidth=0.8, color=f"C{seed}")
        left.plot(times, places[:, 1], linewidth=0.8, color=f"C{seed}", linestyle="--")
        middle.plot(times, places[:, 2], linewidth=0.8, color=f"C{seed}")
    left.set(title="east (full), north (dashed); jump at 40 s", xlabel="time (s)", ylabel="m")
    middle.set(title="height", xlabel="time (s)", ylabel="m")
    flight = fly(nominal(**FIELD, **JUMP), HoldsItsPlace, STAND, map=EMPTY, time_limit_s=SECONDS)
    home = np.array([*EMPTY.uav_start_m[:2], HEIGHT_M])
    away = flight.uav.position_m - home
    errors = np.array([step.estimation_error_m for step in flight.steps])
    errors -= errors[0]
    late = flight.uav.time_s > 12.0
    right.plot(away[late, 0], away[late, 1], linewidth=0.8, label="where it is")
    steps_late = np.array([step.time_s for step in flight.steps]) > 12.0
    right.plot(
        -errors[steps_late, 0],
        -errors[steps_late, 1],
        ".",
        markersize=1,
        label="less what the error grew by",
    )
    right.set(title="a UAV that holds its place", xlabel="east (m)", ylabel="north (m)")
    right.axis("equal")
    right.legend(fontsize="small")
    figure.savefig(folder / "navigation.png", dpi=80)
    pyplot.close(figure)
