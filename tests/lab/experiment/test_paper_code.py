"""What the paper's code counts: collisions and distance when the UAV no longer moves."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from lab.experiment.paper_code import violates_in_its_code
from pytest_garl.flight.flight import TRACK_RATE_HZ
from tests.support.recorded_flights import hit_by_dog, recorded

SIMPLE, MM = "OpenCvLandingSystem", "MultiModuleLandingSystem"


def path(*points: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """Return places at the track's rate through points (s, x, y, z)."""
    corners = np.array(points)
    times = np.arange(round(corners[-1, 0] * TRACK_RATE_HZ) + 1) / TRACK_RATE_HZ
    return np.column_stack([np.interp(times, corners[:, 0], row) for row in corners[:, 1:].T])


def hover(lasts_s: float) -> NDArray[np.float64]:
    """Return a flight that hovers above the marker from 5 s on, and lands 8 m off."""
    end_s = 5 + lasts_s
    return path((0, 3, 0, 0), (5, 0, 0, 9), (end_s, 0, 0, 9), (end_s + 14, 8, 0, 0))


def test_a_uav_that_hovers_above_the_marker_for_long_enough_has_landed() -> None:
    assert not violates_in_its_code(recorded(steps=(), places=hover(21)), MM)
    short = recorded(steps=(), places=hover(4))
    assert violates_in_its_code(short, MM)
    assert not violates_in_its_code(short, SIMPLE)


def test_collisions_count_until_the_uav_is_still() -> None:
    for time_s, counts in ((4.0, True), (24.9, True), (27.0, False)):
        flight = recorded(steps=(), places=hover(21), contacts=(hit_by_dog(time_s),))
        assert violates_in_its_code(flight, MM) is counts
    tree = dataclasses.replace(hit_by_dog(4.0), body="tree-1", kind="tree", body_class="static")
    assert not violates_in_its_code(recorded(steps=(), places=hover(21), contacts=(tree,)), MM)


def test_the_wait_on_the_ground_before_take_off_ends_no_flight() -> None:
    waits = path((0, 3, 0, 0), (25, 3, 0, 0), (30, 0, 0, 9), (40, 0.5, 0, 0))
    assert not violates_in_its_code(recorded(steps=(), places=waits), MM)


def test_a_uav_that_never_takes_off_is_where_it_stands() -> None:
    assert violates_in_its_code(recorded(steps=(), places=path((0, 3, 0, 0), (40, 3, 0, 0))), MM)
