"""A recorded flight, its video, and how its pictures are read."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl import Command, Mission, Observation, PositionSetpoint
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Airframe, Camera, Detection, Diagnostics
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.reports.film import frames
from pytest_garl.reports.film.drawing import Image
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly

LAWN = load_map("lawn")


SCENARIO = random_scenarios(LAWN, genome_for(LAWN), 3, 0, 1)[0].without("bird-1")


FLOWN_S, CLOSING_FRAMES = 3.0, 20


SPEAKS_FROM_S = 1.5


CORNERS = ((100.0, 60.0), (180.0, 60.0), (180.0, 140.0), (100.0, 140.0))


TARGET = (4.0, 12.0, 0.0)


PLAN = ((0.0, -16.5, 3.0), (-5.0, -12.0, 3.0))


CAMERA_PART, STRIP, MAP_PART = np.s_[:480, :640], np.s_[480:, :640], np.s_[:, 640:]


class KeepsPictures:
    """Keeps what it sees in a flight; a subclass has a list of its own."""

    seen: ClassVar[list[Image]]

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m
        self.seen.clear()

    def keep(self, observation: Observation) -> None:
        self.seen.append(observation.image.copy())


class Hovers(KeepsPictures):
    """Climbs to 3 m, and after a while believes something."""

    airframe = Airframe(latency_s=0.0, camera=Camera(width_px=640, height_px=480))
    seen: ClassVar[list[Image]] = []

    def step(self, observation: Observation) -> Command:
        self.keep(observation)
        diagnostics = None
        if observation.time_s >= SPEAKS_FROM_S:
            found = Detection(marker_id=0, confidence=0.9, position_m=TARGET, corners_px=CORNERS)
            diagnostics = Diagnostics(
                phase="hover", detections=(found,), target_m=TARGET, planned_path_m=PLAN
            )
        return PositionSetpoint(position_m=(*self.home[:2], 3.0), diagnostics=diagnostics)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Video:
    flight: Flight
    seen: list[Image]
    pictures: list[Image]


@pytest.fixture(scope="package")
def video() -> Video:
    flight = fly(SCENARIO, Hovers, policy_spec("waypoint"), time_limit_s=FLOWN_S)
    pictures = frames(flight, Placed(SCENARIO, LAWN), Hovers.airframe.camera, "II:lost:descent")
    return Video(flight=flight, seen=list(Hovers.seen), pictures=list(pictures))


def painted(picture: Image, colour: tuple[int, int, int]) -> NDArray[np.int64]:
    """Return the (column, row) pairs of the pixels of exactly this colour."""
    return np.argwhere((picture == colour).all(axis=-1))[:, ::-1]


def on_the_map(x: float, y: float) -> tuple[float, float]:
    """Return a position's pixel on the map: the bounds and 2 m beyond fill its height."""
    scale = 656 / (40 + 2 * 2)
    return 384 / 2 + x * scale, 656 / 2 - y * scale
