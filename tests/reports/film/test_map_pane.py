"""The map's part of the picture."""

from __future__ import annotations

import dataclasses
import math

from pytest_garl.flight.flight import Contact
from pytest_garl.reports.film import frames
from pytest_garl.reports.film.drawing import HIT, MARKER, OBJECTS, UAV
from pytest_garl.scenarios.placed import Placed
from tests.support.videos import LAWN, MAP_PART, SCENARIO, Hovers, Video, on_the_map, painted


def test_the_marker_is_drawn_at_its_place_on_the_map(video: Video) -> None:
    places = painted(video.pictures[0][MAP_PART], MARKER)
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    assert math.dist(middle, on_the_map(*video.flight.marker_position_m)) < 1.0


def test_the_uav_is_drawn_where_it_is_on_the_map(video: Video) -> None:
    places = painted(video.pictures[-1][MAP_PART], UAV)
    x, y, _ = video.flight.uav.position_m[-1]
    assert math.dist(places.mean(axis=0), on_the_map(x, y)) < 3.0


def test_a_removed_npc_is_not_drawn(video: Video) -> None:
    assert len(painted(video.pictures[-1][MAP_PART], OBJECTS["dog"])) > 20
    assert len(painted(video.pictures[-1][MAP_PART], OBJECTS["person"])) > 20
    assert len(painted(video.pictures[-1][MAP_PART], OBJECTS["bird"])) == 0


def test_the_end_of_a_collision_is_crossed_out(video: Video) -> None:
    hit = Contact(
        time_s=3.0,
        body="dog-1",
        kind="dog",
        body_class="dynamic",
        position_m=(-5.0, 5.0, 3.0),
        speed_mps=1.0,
        tilt_rad=0.0,
    )
    flight = dataclasses.replace(video.flight, outcome="collision", contacts=(hit,))
    *_, last = frames(flight, Placed(SCENARIO, LAWN), Hovers.airframe.camera)
    crossed = painted(last[MAP_PART], HIT)
    assert math.dist(crossed.mean(axis=0), on_the_map(-5.0, 5.0)) < 1.0
    assert len(painted(video.pictures[-1][MAP_PART], HIT)) == 0
