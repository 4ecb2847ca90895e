"""Frames that a UAV sees, and the figures that show them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pytest_garl import Airframe, Camera, Flight, Mission, Observation, PositionSetpoint
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND

HEIGHT_M = 6.0
Picture = NDArray[np.uint8]


class Watches:
    """Flies to above the coordinate of the mission, and keeps its observations."""

    airframe = Airframe(latency_s=0.0, camera=Camera(rate_hz=10.0))
    seen: ClassVar[list[Observation]] = []

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        self._goal = (*mission.gps_position_m, HEIGHT_M)
        Watches.seen = []

    def step(self, observation: Observation) -> PositionSetpoint:
        """Keep the observation."""
        Watches.seen.append(observation)
        return PositionSetpoint(position_m=self._goal, yaw_rad=None)


class WatchesSeldom(Watches):
    """Sees a frame a second, which costs less."""

    airframe = Airframe(latency_s=0.0, camera=Camera(rate_hz=1.0))


def watched(
    scenario: Scenario, seconds: float, system: type[Watches] = Watches
) -> tuple[Flight, list[Observation]]:
    """Return a flight and its observations."""
    flight = fly(scenario, system, STAND, map=EMPTY, time_limit_s=seconds)
    return flight, list(Watches.seen)


def seen_at(observations: Sequence[Observation], time_s: float) -> Picture:
    """Return the picture whose stamp is nearest to a time."""
    return min(observations, key=lambda each: abs(each.time_s - time_s)).image


def draw_frames(file: Path, frames: Sequence[tuple[str, Picture]], columns: int) -> None:
    """Draw titled frames in rows to a file."""
    pyplot = plots()
    rows = -(-len(frames) // columns)
    figure, axes = pyplot.subplots(
        rows, columns, figsize=(2.3 * columns, 2.0 * rows), constrained_layout=True, squeeze=False
    )
    for axis in axes.flat:
        axis.axis("off")
    for axis, (title, image) in zip(axes.flat, frames, strict=False):
        axis.imshow(image)
        axis.set_title(title, fontsize=8)
    save(figure, file)


def plots() -> Any:
    """Return matplotlib's pyplot, which draws to files only."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot


def save(figure: Any, file: Path) -> None:
    """Save a figure as a small PNG of 128 colours."""
    from PIL import Image

    figure.savefig(file, dpi=80)
    with Image.open(file) as image:
        image.convert("RGB").quantize(128).save(file, optimize=True)
    plots().close(figure)
