"""A video has a picture for each frame, and an end."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys

import pytest

from pytest_garl import Mission
from pytest_garl.errors import GarlError
from pytest_garl.landing_system import Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.reports.film import frames, rate_hz
from pytest_garl.reports.film.drawing import SYSTEM
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.fly import fly
from tests.support.videos import (
    CAMERA_PART,
    CLOSING_FRAMES,
    LAWN,
    MAP_PART,
    PLAN,
    SCENARIO,
    STRIP,
    TARGET,
    Hovers,
    Video,
    on_the_map,
    painted,
)


class NeverBegins(Hovers):
    def reset(self, mission: Mission) -> None:
        raise ZeroDivisionError("no plan")


def test_there_is_a_picture_for_each_camera_frame_and_two_seconds_of_the_end(video: Video) -> None:
    assert len(video.flight.steps) == 30
    assert len(video.pictures) == 30 + CLOSING_FRAMES
    assert {(each.shape, each.dtype.name) for each in video.pictures} == {((656, 1024, 3), "uint8")}
    assert all((each == video.pictures[-1]).all() for each in video.pictures[-CLOSING_FRAMES:])


def test_a_systems_beliefs_are_drawn_from_their_step_on(video: Video) -> None:
    silent, speaking = video.pictures[14], video.pictures[16]
    for part in (CAMERA_PART, MAP_PART):
        assert len(painted(silent[part], SYSTEM)) == 0
    outline = painted(speaking[CAMERA_PART], SYSTEM)
    assert (outline.min(axis=0) <= (100, 60)).all()
    assert any(math.dist(place, (180, 140)) < 2 for place in outline)
    beliefs = painted(speaking[MAP_PART], SYSTEM)
    for place in (TARGET, PLAN[1]):
        assert any(math.dist(each, on_the_map(*place[:2])) < 2 for each in beliefs)


def test_the_pictures_change_as_time_goes_by(video: Video) -> None:
    for part in (CAMERA_PART, STRIP, MAP_PART):
        assert (video.pictures[5][part] != video.pictures[25][part]).any()


def test_a_flight_that_never_began_has_an_end() -> None:
    flight = fly(SCENARIO, NeverBegins, policy_spec("stationary"), time_limit_s=1.0)
    assert not flight.steps
    pictures = list(
        frames(flight, Placed(SCENARIO, LAWN), Hovers.airframe.camera, "V:ZeroDivisionError")
    )
    assert len(pictures) == CLOSING_FRAMES


def test_a_flight_of_another_scenario_is_refused(video: Video) -> None:
    camera = Hovers.airframe.camera
    elsewhere = SCENARIO.replace({"marker.x": -SCENARIO["marker.x"]})
    with pytest.raises(GarlError, match=r"its marker lay at .* take the scenario and the map"):
        next(frames(video.flight, Placed(elsewhere, LAWN), camera))
    fewer = SCENARIO.without("dog-1")
    with pytest.raises(GarlError, match=r"it has the objects .*dog-1.* map 'lawn' has person-1"):
        next(frames(video.flight, Placed(fewer, LAWN), camera))


def test_the_rate_is_the_recorded_one(video: Video) -> None:
    camera = Camera(rate_hz=50.0)
    steps = tuple(
        dataclasses.replace(step, time_s=index * 5 / 240)
        for index, step in enumerate(video.flight.steps)
    )
    assert rate_hz(dataclasses.replace(video.flight, steps=steps), camera) == 48.0
    assert rate_hz(dataclasses.replace(video.flight, steps=()), camera) == 50.0


def test_drawing_needs_neither_the_encoder_nor_pytest_nor_the_physics() -> None:
    code = (
        "import sys, pytest_garl.reports.film\n"
        "print({'imageio_ffmpeg', 'pytest', 'pybullet'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
