from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_garl.flight.flight import Flight
from pytest_garl.reports.html.moments import (
    BEFORE_END_S,
    MOST,
    SAME_S,
    last_far,
    moments_of,
    telling_moment,
)
from pytest_garl.verdicts.evidence import Evidence
from tests.support.recorded_flights import READABLE, hit_by_dog, recorded, seen


def labels(flight: Flight) -> list[str]:
    return [each.label for each in moments_of(Evidence(flight))]


def test_moments_are_in_the_order_of_time_and_end_with_the_event() -> None:
    flight = recorded(steps=seen(range(20, 60)), outcome="gave_up", given_up_s=6.0, end_s=6.1)
    found = moments_of(Evidence(flight))
    times = [each.time_s for each in found]
    assert times == sorted(times)
    assert found[-1].label == "The landing system gives up"
    assert found[-1].time_s == Evidence(flight).decided_s == 6.0
    assert found[0].label.startswith("The marker can be read for the first time")
    assert 6.0 - BEFORE_END_S in times


def test_moments_at_almost_the_same_time_share_a_picture() -> None:
    found = moments_of(Evidence(recorded(steps=seen(range(30, 60)), given_up_s=3.0 + 0.1)))
    gaps = np.diff([each.time_s for each in found])
    assert (gaps >= SAME_S).all()
    assert any("; " in each.label for each in found)


def test_no_flight_has_more_moments_than_fit() -> None:
    views = [*range(20, 30), *range(50, 55), *range(90, 99)]
    steps = tuple(
        dataclasses.replace(each, objects_visible=("dog-1",) if index in views else ())
        for index, each in enumerate(seen(range(20, 40)))
    )
    flight = recorded(steps=steps, outcome="collision", contacts=(hit_by_dog(9.9),), end_s=9.9)
    assert len(moments_of(Evidence(flight))) <= MOST
    assert labels(flight)[-1] == "The UAV hits dog-1"
    assert any("comes into view again" in label for label in labels(flight))


def test_the_small_picture_is_the_last_from_above_the_ground() -> None:
    sinks = np.array([[0.0, 0.0, max(0.2, 9.0 - index / 20)] for index in range(241)])
    flight = recorded(steps=seen(range(20, 60)), outcome="landed", places=sinks, end_s=12.0)
    found = moments_of(Evidence(flight))
    assert found[-1].label == "The UAV touches down"
    far = last_far(flight, found)
    assert far is not None
    assert far.time_s < 9.5
    assert far == max((each for each in found if each.time_s < 8.5), key=lambda each: each.time_s)
    stays = recorded(steps=seen(range(20, 60)), outcome="landed", places=0 * sinks, end_s=12.0)
    assert last_far(stays, moments_of(Evidence(stays))) == moments_of(Evidence(stays))[-1]
    assert last_far(stays, ()) is None


def test_a_turn_before_the_descent_is_none() -> None:
    climbs = np.array([[0.0, 0.0, min(9.0, 1.0 + index / 10)] for index in range(241)])
    flight = recorded(steps=(), outcome="gave_up", given_up_s=9.0, places=climbs)
    assert "The UAV turns back up" not in labels(flight)
    falls_and_climbs = climbs.copy()
    falls_and_climbs[120:160, 2] = 4.0
    again = recorded(steps=(), outcome="gave_up", given_up_s=9.0, places=falls_and_climbs)
    assert "The UAV turns back up" in labels(again)


@pytest.mark.parametrize(
    ("outcome", "label"),
    [
        ("landed", "The UAV touches down"),
        ("not_landed", "The flight ends"),
        ("crashed", "The landing system fails"),
    ],
)
def test_the_last_moment_says_how_the_flight_ended(outcome: str, label: str) -> None:
    assert labels(recorded(steps=(), outcome=outcome))[-1] == label


def test_a_flight_of_one_sample_has_a_moment() -> None:
    flight = recorded(steps=(), places=np.zeros((1, 3)), end_s=0.0)
    assert len(moments_of(Evidence(flight))) == 1


def test_a_flight_without_a_landing_is_shown_where_the_marker_is_best_to_read() -> None:
    dim = dataclasses.replace(READABLE, contrast=6.0)
    steps = tuple(
        dataclasses.replace(each, marker=dim) if each.marker and not 35 <= i < 38 else each
        for i, each in enumerate(seen(range(20, 60)))
    )
    flight = recorded(steps=steps, given_up_s=9.0)
    shows = telling_moment(Evidence(flight), moments_of(Evidence(flight)))
    assert shows is not None
    assert 3.5 <= shows.time_s < 3.8
    assert "The marker is best to read" in shows.label


def test_a_marker_that_was_never_in_the_picture_leaves_the_last_view_from_above() -> None:
    flight = recorded(steps=seen(()), given_up_s=9.0)
    found = moments_of(Evidence(flight))
    assert telling_moment(Evidence(flight), found) == last_far(flight, found)


def test_a_collision_is_shown_when_the_body_is_last_in_view() -> None:
    steps = tuple(
        dataclasses.replace(each, objects_visible=("dog-1",) if 60 <= i < 75 else ())
        for i, each in enumerate(seen(range(20, 60)))
    )
    flight = recorded(steps=steps, outcome="collision", contacts=(hit_by_dog(8.0),), end_s=8.0)
    shows = telling_moment(Evidence(flight), moments_of(Evidence(flight)))
    assert shows is not None
    assert shows.time_s == 7.4


def test_a_touchdown_is_shown_from_three_metres() -> None:
    sinks = np.array([[0.0, 0.0, max(0.2, 9.0 - index / 20)] for index in range(241)])
    flight = recorded(steps=seen(range(20, 60)), outcome="landed", places=sinks, end_s=12.0)
    shows = telling_moment(Evidence(flight), moments_of(Evidence(flight)))
    assert shows is not None
    assert "passes" in shows.label


def test_the_moment_that_shows_the_cause_stays_among_many() -> None:
    steps = tuple(
        dataclasses.replace(each, marker_px=90.0 if i == 25 else each.marker_px)
        for i, each in enumerate(seen([*range(20, 30), *range(50, 55), *range(90, 99)]))
    )
    flight = recorded(steps=steps, given_up_s=9.9)
    found = moments_of(Evidence(flight))
    assert len(found) <= MOST
    assert any("best to read" in each.label for each in found)
