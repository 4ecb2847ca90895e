"""The side view of a UAV that holds its place."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.flight.flight import HOLDS, Event, Flight
from pytest_garl.landing_system import Diagnostics
from pytest_garl.reports.film import frames
from pytest_garl.reports.film.drawing import MARKER, SYSTEM, UAV, Image
from pytest_garl.reports.film.side_view import HEIGHT, WIDTH
from pytest_garl.scenarios.placed import Placed
from tests.support.videos import LAWN, MAP_PART, SCENARIO, Hovers, Video, painted

SIDE_PART = np.s_[-HEIGHT:, :WIDTH]


def last_picture(flight: Flight) -> Image:
    *_, last = frames(flight, Placed(SCENARIO, LAWN), Hovers.airframe.camera)
    return np.asarray(last[MAP_PART][SIDE_PART])


def held(flight: Flight, said: Diagnostics) -> Flight:
    steps = tuple(dataclasses.replace(step, diagnostics=said) for step in flight.steps)
    events = (Event(time_s=0.0, name=HOLDS, text="holds"),)
    return dataclasses.replace(flight, steps=steps, events=events, outcome="held")


def middle(places: NDArray[np.intp]) -> tuple[float, float]:
    x, y = (places.min(axis=0) + places.max(axis=0)) / 2
    return float(x), float(y)


def test_plan_and_obstacles_are_drawn_over_the_marker(video: Video) -> None:
    x, y = video.flight.marker_position_m
    path = ((x, y, 2.0), (x, y, 1.0))
    shown = last_picture(held(video.flight, Diagnostics(planned_path_m=path)))
    marker, plan = painted(shown, MARKER), painted(shown, SYSTEM)
    assert middle(marker)[0] == pytest.approx(WIDTH / 2, abs=1.0)
    assert middle(plan)[0] == pytest.approx(WIDTH / 2, abs=1.0)
    assert middle(plan)[1] < middle(marker)[1]
    obstacle = ((x + 2.0, y, 0.5),)
    with_obstacle = last_picture(
        held(video.flight, Diagnostics(planned_path_m=path, obstacles_m=obstacle))
    )
    more = painted(with_obstacle, SYSTEM)
    assert more[:, 0].max() > plan[:, 0].max() + 20
    assert len(more) > len(plan)


def test_a_flight_that_moves_has_no_side_view(video: Video) -> None:
    shown = last_picture(video.flight)
    framed = last_picture(held(video.flight, Diagnostics()))
    assert len(painted(framed, MARKER)) > len(painted(shown, MARKER))
    assert not np.array_equal(shown, framed)
    assert len(painted(shown, UAV)) != len(painted(framed, UAV))
