"""What a nominal landing sees of the marker, whatever the system that gave up has flown."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from pytest_garl import Abort, Command, Observation
from pytest_garl.flight.flight import Flight, NominalView, ObjectRecord, Track
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.nominal import (
    SIGHT_HEIGHTS_M,
    nominal_arrival_s,
    nominal_landing_s,
    nominal_views,
)
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.excuses import READABLE_S
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.support.flights import EMPTY, LAWN, STAND, Hovers, Scripted, nominal

PEOPLE = dataclasses.replace(LAWN, objects=(("person", 4),))


COVER = {"cover__share_percent": 100.0, "cover__from_s": 5.0, "cover__lasts_s": 50.0}


class AbortsAtOnce(Scripted):
    def step(self, observation: Observation) -> Command:
        return Abort() if observation.time_s > 1 else self.hover(2.0)


def track_at(place_m: tuple[float, float, float]) -> Track:
    return Track(
        time_s=np.zeros(1),
        position_m=np.array([place_m]),
        attitude=np.array([[0.0, 0.0, 0.0, 1.0]]),
        velocity_mps=np.zeros((1, 3)),
    )


def given_up(map: Map, places: Mapping[str, tuple[float, float]], **genes: float) -> Flight:
    """Return the views of a flight in which objects stand at places."""
    scenario = nominal(**genes)
    objects = tuple(
        ObjectRecord(
            name=name,
            type=kind,
            track=track_at((*places.get(name, (60.0, 60.0)), OBJECT_TYPES[kind].altitude_m)),
            moves=np.zeros((0, 2)),
        )
        for name, kind in map.present_objects
    )
    empty = fly(scenario, AbortsAtOnce, STAND, map=EMPTY, time_limit_s=20)
    moved = dataclasses.replace(empty, objects=objects)
    views = nominal_views(moved, Placed(scenario, map), Camera())
    return dataclasses.replace(moved, nominal_views=views)


def above(flight: Flight) -> list[NominalView]:
    return [view for view in flight.nominal_views if view.place == "above"]


@pytest.mark.parametrize("genes", [{}, {"marker__x": 0.6, "marker__y": -0.6}, {"marker__y": 0.9}])
def test_the_reference_pilot_arrives_and_lands_when_a_nominal_landing_does(genes: Any) -> None:
    scenario = nominal(**genes)
    flight = fly(scenario, ReferencePilot, STAND, map=EMPTY)
    away = flight.uav.position_m[:, :2] - Placed(scenario, EMPTY).marker_m
    arrived_s = flight.uav.time_s[np.argmax(np.hypot(*away.T) < 0.1)]
    assert flight.touchdown is not None
    assert flight.nominal_arrival_s == pytest.approx(arrived_s, abs=0.3)
    assert flight.nominal_landing_s == pytest.approx(flight.touchdown.time_s, abs=0.5)
    assert flight.nominal_arrival_s == nominal_arrival_s(Placed(scenario, EMPTY))
    assert flight.nominal_landing_s == nominal_landing_s(Placed(scenario, EMPTY))
    assert flight.nominal_views == ()


@pytest.mark.parametrize("system", [AbortsAtOnce, Hovers])
def test_views_come_with_flights_that_end_without_a_landing(system: type) -> None:
    flight = fly(nominal(), system, STAND, map=EMPTY, time_limit_s=20)
    assert flight.outcome in ("gave_up", "not_landed")
    assert {view.height_m for view in above(flight)} == set(SIGHT_HEIGHTS_M)
    times = [view.time_s for view in flight.nominal_views]
    assert times == sorted(times)
    assert {view.place for view in flight.nominal_views} == {"search", "above"}


def test_views_do_not_depend_on_the_path_of_the_system() -> None:
    first, second = (
        fly(nominal(environment__fog=0.3), system, STAND, map=EMPTY, time_limit_s=20)
        for system in (AbortsAtOnce, Hovers)
    )
    assert first.elapsed_s < second.elapsed_s
    assert first.nominal_views == second.nominal_views


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.9, 0.0), (-0.65, 0.65), (0.2, -0.95)])
def test_the_search_shows_every_marker_of_the_disc(place: tuple[float, float]) -> None:
    flight = given_up(EMPTY, {}, marker__x=place[0], marker__y=place[1])
    search = [view for view in flight.nominal_views if view.place == "search"]
    assert max(view.marker.share_in_frame for view in search) == 1.0
    assert Evidence(flight).expected_readable_s > 5 * READABLE_S


def test_the_search_shows_a_marker_far_from_a_wrong_coordinate() -> None:
    genes = {"marker__y": 1.0, "told__error_m": 2.5, "told__towards_deg": 270.0}
    flight = given_up(EMPTY, {}, **genes)
    search = [view for view in flight.nominal_views if view.place == "search"]
    assert max(view.marker.share_in_frame for view in search) == 1.0


def test_a_clear_sight_can_be_read_and_thick_fog_cannot() -> None:
    clear = Evidence(given_up(EMPTY, {})).expected_readable_s
    foggy = given_up(EMPTY, {}, environment__fog=1.0, environment__dust=1.0)
    far = [view.marker.contrast for view in foggy.nominal_views if view.height_m > 9]
    assert clear > 5 * READABLE_S
    assert max(far) < 5


def test_a_marker_wholly_under_snow_is_hidden() -> None:
    flight = given_up(EMPTY, {}, environment__road_snow=1.0)
    assert all(view.marker.border_hidden > 0.95 for view in flight.nominal_views)
    assert Evidence(flight).expected_readable_s < READABLE_S


def test_people_who_stand_on_the_marker_hide_it() -> None:
    marker = Placed(nominal(), PEOPLE).marker_m
    corners = [(-0.3, -0.3), (-0.3, 0.3), (0.3, -0.3), (0.3, 0.3)]
    places = {
        name: (marker[0] + dx, marker[1] + dy)
        for (name, _), (dx, dy) in zip(PEOPLE.present_objects, corners, strict=True)
    }
    free, crowded = given_up(PEOPLE, {}), given_up(PEOPLE, places)
    hidden = [
        np.mean([view.marker.bits_hidden for view in above(each)]) for each in (free, crowded)
    ]
    assert hidden[0] < 0.05 < 0.15 < hidden[1]
    assert Evidence(crowded).expected_readable_s < Evidence(free).expected_readable_s - 3


@pytest.mark.parametrize(
    ("system", "snow", "signature", "readable"),
    [
        # After the cover the marker lies free for a minute, or under snow.
        (Hovers, 0.0, "II:never-seen:cover", True),
        (Hovers, 1.0, "late:never-gave-up", False),
        (AbortsAtOnce, 0.0, "", False),
    ],
)
def test_a_landing_that_waits_sees_a_marker_that_comes_back(
    system: type, snow: float, signature: str, readable: bool
) -> None:
    scenario = nominal(**COVER, environment__road_snow=snow, marker__y=0.9)
    flight = fly(scenario, system, STAND, map=EMPTY, time_limit_s=120)
    attempts = {view.attempt for view in flight.nominal_views}
    assert (max(attempts) > 3) == (system is Hovers)
    assert attempts == {*range(len(attempts))}
    assert max(view.time_s for view in flight.nominal_views) < 120
    assert (Evidence(flight).expected_readable_s >= READABLE_S) == readable
    assert judge(flight, Limits()).signature == signature


@pytest.mark.parametrize(
    ("genes", "map", "tries_again"),
    [
        ({}, EMPTY, False),
        ({"environment__fog": 1.0}, EMPTY, False),
        ({"outage__lasts_s": 5.0}, EMPTY, True),
        ({}, PEOPLE, True),
    ],
)
def test_a_landing_waits_only_for_what_comes_and_goes(
    genes: Any, map: Map, tries_again: bool
) -> None:
    scenario = nominal(**genes)
    alone = fly(scenario, Hovers, STAND, map=EMPTY, time_limit_s=60)
    flight = dataclasses.replace(alone, objects=given_up(map, {}).objects)
    views = nominal_views(flight, Placed(scenario, map), Camera())
    assert any(view.attempt for view in views) == tries_again


def test_objects_stay_where_a_flight_that_ended_early_left_them() -> None:
    flight = fly(nominal(), AbortsAtOnce, STAND, map=EMPTY, time_limit_s=20)
    assert flight.elapsed_s < min(view.time_s for view in above(flight))
    assert math.isfinite(Evidence(flight).expected_readable_s)


def test_a_place_from_which_nothing_has_changed_is_drawn_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario, drawn = nominal(**COVER), []
    flight = fly(scenario, Hovers, STAND, map=EMPTY, time_limit_s=100)

    def noted(self: Renderer, *rest: Any) -> Frame:
        drawn.append(rest)
        return render(self, *rest)

    render = Renderer.render
    monkeypatch.setattr(Renderer, "render", noted)
    views = nominal_views(flight, Placed(scenario, EMPTY), Camera())
    assert views == flight.nominal_views
    places = {(view.place, view.height_m, view.marker) for view in views}
    assert len(places) <= len(drawn) < len(views) / 2
