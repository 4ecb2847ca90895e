"""The depth camera's reach and holes: what the landing system gets, and what stays as it is."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest

from pytest_garl import Camera, Command, Mission, Observation
from pytest_garl.simulation.camera.depth_sensor import DepthSensor, reach_m
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, Scripted, nominal

CAMERA = Camera()
PLANE = np.full((240, 320), 9.0, np.float32)


def measured(time_s: float = 0.0, **values: float) -> np.ndarray:
    return DepthSensor(nominal(**values), CAMERA).measured(PLANE, time_s)


@pytest.mark.parametrize("extinction_per_m", [1e-6, 0.04, 0.6, 5.0])
def test_the_signal_at_the_reach_is_that_of_clear_air(extinction_per_m: float) -> None:
    reach = reach_m(10.0, extinction_per_m)
    assert reach * math.exp(extinction_per_m * reach) == pytest.approx(10.0, rel=1e-9)
    assert reach_m(10.0, 0.0) == 10.0


def test_a_nominal_depth_camera_returns_the_true_depth_in_any_weather() -> None:
    assert measured() is PLANE
    assert measured(environment__fog=0.15) is PLANE


def test_a_limit_cuts_rays_by_their_length() -> None:
    depth = measured(depth__range_m=10.0)
    rows, columns = np.mgrid[0:240, 0:320]
    (cx, cy), focal = CAMERA.centre_px, CAMERA.focal_px
    length = 9.0 * np.sqrt(1 + ((columns - cx) / focal) ** 2 + ((rows - cy) / focal) ** 2)
    assert ((depth == 0.0) == (length > 10.0)).all()
    assert (depth[depth > 0] == 9.0).all()
    assert (PLANE == 9.0).all()


def test_fog_shortens_the_reach_when_the_environment_changes() -> None:
    clear, foggy = nominal(depth__range_m=10.0), nominal(depth__range_m=10.0, environment__fog=0.15)
    sensor = DepthSensor(clear, CAMERA)
    before = sensor.measured(PLANE, 0.0)
    sensor.change(foggy)
    assert np.count_nonzero(sensor.measured(PLANE, 0.0)) == 0 < np.count_nonzero(before)
    assert np.array_equal(
        sensor.measured(PLANE, 0.0), measured(environment__fog=0.15, depth__range_m=10.0)
    )


@pytest.mark.parametrize("percent", [5.0, 30.0, 80.0])
def test_holes_cover_their_share_of_the_picture(percent: float) -> None:
    sensor = DepthSensor(nominal(depth__holes_percent=percent), CAMERA)
    shares = [np.mean(sensor.measured(PLANE, time) == 0) for time in np.arange(0.0, 100.0, 0.25)]
    assert 100 * np.mean(shares) == pytest.approx(percent, abs=2.0)


def test_holes_are_patches_that_persist_for_some_frames() -> None:
    sensor = DepthSensor(nominal(depth__holes_percent=30.0), CAMERA)
    first, next_one, later = (sensor.measured(PLANE, time) == 0 for time in (0.0, 0.05, 5.0))
    # Neighbours agree: single pixels would differ in 2 x 0.3 x 0.7 of all pairs.
    assert np.mean(first[:, 1:] != first[:, :-1]) < 0.1
    assert np.mean(first != next_one) < 0.15 < 0.3 < np.mean(first != later)
    again = DepthSensor(nominal(depth__holes_percent=30.0), CAMERA)
    assert np.array_equal(again.measured(PLANE, 5.0) == 0, later)


class Watches(Scripted):
    needs_camera = True
    seen: ClassVar[list[tuple[int, np.ndarray]]] = []

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.seen.clear()

    def step(self, observation: Observation) -> Command:
        self.seen.append((int(observation.image.sum()), observation.depth_m))
        return self.hover(4.0)


def flown(**values: float) -> list[tuple[int, np.ndarray]]:
    fly(nominal(**values), Watches, STAND, map=EMPTY, time_limit_s=3.0)
    return list(Watches.seen)


@pytest.mark.sim
def test_a_flight_has_its_limit_and_the_same_pictures() -> None:
    without, limited = flown(), flown(depth__range_m=1.5)
    assert [image for image, _ in limited] == [image for image, _ in without]
    true, short = without[-1][1], limited[-1][1]
    assert true.max() > 1.5
    assert np.count_nonzero(short == 0) > 0
    assert np.array_equal(short[short > 0], true[short > 0])


@pytest.mark.sim
def test_a_frozen_picture_keeps_its_holes() -> None:
    values = {"outage__from_s": 1.0, "outage__lasts_s": 9.0, "outage__frozen": 1.0}
    seen = flown(depth__holes_percent=30.0, **values)
    assert np.array_equal(seen[-1][1], seen[-10][1])
    assert (seen[-1][1] == 0).any()
