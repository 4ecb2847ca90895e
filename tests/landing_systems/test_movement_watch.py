"""The watch over the column below takes a depth of 0 for no measurement."""

from __future__ import annotations

import numpy as np
import pytest

from landing_systems.modules.movement_watch import MovementWatch
from pytest_garl import Camera, Mission, Observation

CAMERA = Camera()
MISSION = Mission(
    gps_position_m=(0.0, 0.0),
    home_m=(0.0, 0.0, 0.0),
    search_altitude_m=10.0,
    marker_id=0,
    marker_side_m=1.5,
    marker_dictionary="DICT_5X5_50",
    camera=CAMERA,
    time_limit_s=60.0,
)


def points(watch: MovementWatch, depth_m: float, height_m: float, time_s: float) -> int:
    return watch.points_in_the_way(
        Observation(
            time_s=time_s,
            position_m=np.array([0.0, 0.0, height_m]),
            velocity_mps=np.zeros(3),
            attitude=np.array([0.0, 0.0, 0.0, 1.0]),
            image=np.zeros((CAMERA.height_px, CAMERA.width_px, 3), np.uint8),
            depth_m=np.full((CAMERA.height_px, CAMERA.width_px), depth_m, np.float32),
        )
    )


@pytest.mark.parametrize("height_m", [0.1, 5.0])
def test_nothing_measured_is_neither_a_thing_nor_bare_ground(height_m: float) -> None:
    watch = MovementWatch(MISSION)
    assert points(watch, 0.0, height_m, 0.0) == 0
    # Bare ground before would make this a thing that moves, also off the column.
    blind_first = points(watch, 2.0, 5.0, 1.0)
    assert blind_first == points(MovementWatch(MISSION), 2.0, 5.0, 1.0) > 0
