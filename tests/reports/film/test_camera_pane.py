"""The camera's part of the picture."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_garl.landing_system import Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.reports.film import frames
from pytest_garl.reports.film.drawing import MARKER
from pytest_garl.scenarios.placed import Placed, marker_genes
from pytest_garl.simulation.fly import fly
from tests.simulation.test_environment import WEATHERMAKER
from tests.support.videos import CAMERA_PART, FLOWN_S, LAWN, SCENARIO, Hovers, Video, painted


def test_the_camera_pane_shows_the_systems_image(video: Video) -> None:
    # Every fifth frame falls on a recorded pose; between two the pose is interpolated.
    for index, most in ((5, 0.01), (10, 0.01), (12, 3.0), (14, 3.0)):
        shown = video.pictures[index][CAMERA_PART].astype(int)
        assert np.abs(shown - video.seen[index]).mean() <= most
    assert np.abs(video.seen[5].astype(int) - video.seen[10]).mean() > 3.0


def test_the_camera_part_shows_the_environment_as_it_was_changed() -> None:
    flight = fly(SCENARIO, Hovers, WEATHERMAKER, time_limit_s=FLOWN_S)
    assert any(item.changes for item in flight.objects)
    pictures = list(frames(flight, Placed(SCENARIO, LAWN), Hovers.airframe.camera))
    # From 1.5 s on what it believes is drawn over what it sees.
    for index, most in ((5, 0.01), (10, 0.01), (15, 2.0), (20, 2.0), (25, 2.0)):
        shown = pictures[index][CAMERA_PART].astype(int)
        assert np.abs(shown - Hovers.seen[index]).mean() <= most
    assert np.abs(Hovers.seen[5].astype(int) - Hovers.seen[10]).mean() > 20.0


def test_the_marker_is_outlined_where_the_camera_has_it() -> None:
    near = SCENARIO.replace(marker_genes((0.0, -7.4), LAWN))
    flight = fly(near, Hovers, policy_spec("stationary"), time_limit_s=0.2)
    # Seen from straight above: half a side at focal 320 px from 3 m.
    uav = dataclasses.replace(
        flight.uav,
        position_m=np.tile([*flight.marker_position_m, 3.05], (len(flight.uav.time_s), 1)),
        attitude=np.tile([0.0, 0.0, 0.0, 1.0], (len(flight.uav.time_s), 1)),
    )
    above = dataclasses.replace(flight, uav=uav)
    picture = next(frames(above, Placed(near, LAWN), Hovers.airframe.camera))
    places = painted(picture[CAMERA_PART], MARKER)
    half = 0.75 * 320 / 3.0
    assert places.min(axis=0) == pytest.approx([319.5 - half, 239.5 - half], abs=1.5)
    assert places.max(axis=0) == pytest.approx([319.5 + half, 239.5 + half], abs=1.5)


@pytest.mark.parametrize("shape", [(160, 120), (1280, 720), (200, 200)])
def test_any_camera_fits(video: Video, shape: tuple[int, int]) -> None:
    camera = Camera(width_px=shape[0], height_px=shape[1])
    picture = next(frames(video.flight, Placed(SCENARIO, LAWN), camera))
    assert picture.shape == (656, 1024, 3)
    lit = np.argwhere(picture[CAMERA_PART].any(axis=-1))
    height, width = lit.max(axis=0) - lit.min(axis=0) + 1
    assert width / height == pytest.approx(shape[0] / shape[1], rel=0.02)
    assert width == 640 or height == 480
