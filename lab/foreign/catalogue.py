"""The foreign systems, and the task that each of them is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from lab.foreign import blueos, cuav_landing, how_do_drones_work
from lab.foreign.repository import Repository
from pytest_garl import Start
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.scenarios.task import Task


@dataclass(frozen=True, slots=True, kw_only=True)
class Foreign:
    """One landing system of somebody else."""

    name: str
    system: Callable[[], Any]
    repository: Repository
    marker: MarkerSpec
    start_height_m: float

    @property
    def task(self) -> Task:
        """The marker on the ground, and a hover above the told coordinate."""
        return Task(marker=self.marker, start=Start(mode="hover", height_m=self.start_height_m))


SYSTEMS = (
    Foreign(
        name="how-do-drones-work",
        system=how_do_drones_work.HowDoDronesWorkLandingSystem,
        repository=how_do_drones_work.REPOSITORY,
        marker=how_do_drones_work.MARKER,
        start_height_m=how_do_drones_work.START_HEIGHT_M,
    ),
    Foreign(
        name="blueos",
        system=blueos.BlueOsLandingSystem,
        repository=blueos.REPOSITORY,
        marker=blueos.MARKER,
        start_height_m=blueos.START_HEIGHT_M,
    ),
    Foreign(
        name="cuav-landing",
        system=cuav_landing.CuavLandingSystem,
        repository=cuav_landing.REPOSITORY,
        marker=cuav_landing.MARKER,
        start_height_m=cuav_landing.START_HEIGHT_M,
    ),
)
