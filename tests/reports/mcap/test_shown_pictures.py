"""What is drawn again is what the landing system was shown."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from pytest_garl import Abort, Command, Observation, PositionSetpoint
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Airframe, Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.mcap.export import Place
from pytest_garl.reports.mcap.shown_pictures import ShownPictures, taken_s
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.fly import fly
from tests.support.videos import LAWN, SCENARIO, KeepsPictures

pytestmark = pytest.mark.sim
LATE = {
    "timing.latency_ms": 150.0,
    "timing.jitter_ms": 60.0,
    "timing.dropped_percent": 25.0,
    "timing.stamp_error_ms": 30.0,
}
TURNED = {
    "camera.mounting_roll_deg": 2.0,
    "camera.mounting_yaw_deg": -3.0,
    "camera.calibration_error_percent": 2.0,
    "camera.exposure_ms": 8.0,
}
OUTAGE = {"outage.from_s": 1.05, "outage.lasts_s": 0.6}


class Watches(KeepsPictures):
    """Climbs while it turns, and gives up near the end."""

    airframe = Airframe(latency_s=0.0, camera=Camera(width_px=160, height_px=120))
    seen: ClassVar[list[Image]] = []

    def step(self, observation: Observation) -> Command:
        self.keep(observation)
        if observation.time_s > 2.2:
            return Abort()
        return PositionSetpoint(position_m=(*self.home[:2], 4.0), yaw_rad=1.0)


def flown(**genes: float) -> tuple[Flight, Scenario, list[Image]]:
    scenario = SCENARIO.replace(genes)
    flight = fly(scenario, Watches, policy_spec("waypoint"), time_limit_s=3.0)
    return flight, scenario, list(Watches.seen)


def again(flight: Flight, scenario: Scenario) -> ShownPictures:
    camera = Watches.airframe.camera
    return ShownPictures(flight, Place(placed=Placed(scenario, LAWN), camera=camera), camera)


def difference(first: Image, second: Image) -> float:
    return float(np.abs(first.astype(float) - second).mean())


@pytest.mark.parametrize(
    "genes", [{}, LATE, TURNED, OUTAGE, OUTAGE | {"outage.frozen": 1.0}, LATE | TURNED | OUTAGE]
)
def test_pictures_are_those_that_the_system_was_shown(genes: dict[str, float]) -> None:
    flight, scenario, seen = flown(**genes)
    pictures = list(again(flight, scenario))
    assert len(pictures) == len(flight.steps) >= len(seen) > 10
    off = [difference(picture.image, image) for picture, image in zip(pictures, seen, strict=False)]
    # Between the samples of the track the pose is interpolated.
    assert max(off) < 4.0
    assert np.median(off) < 1.0
    assert [picture.step for picture in pictures] == list(flight.steps)


def test_late_pictures_were_taken_earlier() -> None:
    flight, scenario, _ = flown(**LATE)
    times = taken_s(flight, scenario, Watches.airframe.camera)
    late = [step.time_s - taken for step, taken in zip(flight.steps, times, strict=True)]
    given_up = next(i for i, step in enumerate(flight.steps) if step.command == "Abort")
    assert all(0.15 <= each < 0.27 for each in late[: given_up + 1])
    assert {round(taken * 10, 6) % 1 for taken in times} == {0.0}
    # After it the simulator looks without delay.
    assert late[given_up + 1 :] == [0.0] * (len(late) - given_up - 1)


def test_pictures_of_another_scenario_keep_the_times_of_their_steps() -> None:
    flight, _, _ = flown()
    times = taken_s(flight, SCENARIO.replace(LATE), Watches.airframe.camera)
    assert times == tuple(step.time_s for step in flight.steps)


def test_a_camera_that_fails_outlines_no_marker() -> None:
    flight, scenario, _ = flown(**OUTAGE)
    for picture in again(flight, scenario):
        fails = 1.05 <= picture.time_s < 1.65
        assert (picture.image.max() == 0) == fails
        assert (len(picture.outline_px) == 0) >= fails
