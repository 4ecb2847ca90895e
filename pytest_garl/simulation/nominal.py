"""How and when a nominal landing would have seen the marker, whatever path the system chose.

A nominal landing climbs to the search height, crosses to the coordinate that the mission tells,
looks for the marker from there and from a ring about it, crosses to the marker and comes down.
It is level, its nose points east.  A camera that is mounted with a tilt looks from so far aside
that it shows the place.  Nothing is painted.

Where the sight of the marker may change, it waits if need be: above the marker it climbs and comes
down again, until the time is up or the landing was given up.  So a marker that is covered for a
minute and then lies free is seen.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

from pytest_garl.flight.flight import Flight, MarkerView, NominalView, ObjectRecord
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.solids import BodyPose
from pytest_garl.simulation.camera.true_camera import Mounting, looks_at, true_camera
from pytest_garl.simulation.environment import environment_at
from pytest_garl.simulation.events import Event
from pytest_garl.simulation.landing_moments import RecordedMoments
from pytest_garl.simulation.system_under_test.descent import LAND_BELOW_M, SLOW_BELOW_M
from pytest_garl.simulation.system_under_test.mission import SEARCH_ALTITUDE_M
from pytest_garl.simulation.system_under_test.reference_pilot import CRUISE_MPS, DESCENT_MPS

Place = tuple[float, float]
STARTS_AND_STOPS_S = 5.1
"""What the reference pilot takes for its climb to 10 m, at 3 m/s, and for starting and stopping on
its way across; ``test_nominal.py`` measures it."""
CLIMB_MPS = 3.0
"""The speed of a ``PositionSetpoint`` that names none."""
SEARCH_MPS = 2.0
"""Speed of the search: engineering estimate, half of the reference pilot's speed on its way across,
so that a marker stays in the frame for seconds at 10 m above the ground."""
RING_M = 5.0
"""Radius of the search.  A level camera with the default field of view sees 7.5 m ahead of it and
10 m to its sides from the search height, so that ring and middle show all of the marker's disc of
7.5 m, and 3.5 m more for the error of the coordinate."""
RING_PLACES = 8
SIGHT_HEIGHTS_M = (10.0, 6.0, 3.0)
"""Heights above the marker from which the descent looks."""
LEVEL = (0.0, 0.0, 0.0, 1.0)
_LONGEST_LOOK_S = 1.0
"""People, dogs and birds move on while one looks: a longer look counts as several."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    """A look from one place, from ``time_s`` on."""

    time_s: float
    duration_s: float
    place: Literal["search", "above"]
    place_m: Place
    height_m: float
    attempt: int


def nominal_arrival_s(placed: Placed) -> float:
    """Return when a pilot that knows the marker's place is above it: the reference pilot."""
    start = placed.start_m
    return _up_s(start[2]) + _across_s(start[:2], placed.marker_m)


def nominal_landing_s(placed: Placed) -> float:
    """Return when a pilot that knows the marker's place has landed on it without waiting."""
    return nominal_arrival_s(placed) + _descent_s(SEARCH_ALTITUDE_M)


def nominal_views(flight: Flight, placed: Placed, camera: Camera) -> tuple[NominalView, ...]:
    """Return the views of a nominal landing in the scenario that was flown.

    The objects are where they were at that time of the flight, or at its end if it had ended; the
    environment is that to which NPC policies had changed it.  The UAV's own path plays no part, but
    that an event came when it did.  A camera that fails shows nothing.  Later attempts are those
    whose descent ends before the system gave up, or before the time was up.  The camera is the true
    one, turned and dirty as the scenario says; it hovers while it looks, so that a long exposure
    does not blur.
    """
    scenario, moments = placed.scenario, RecordedMoments(flight)
    renderer = renderer_of(placed, true_camera(camera, scenario), moments, colour=False)
    attitude = Mounting(scenario).attitude(LEVEL)
    shown, views, outage = scenario, [], Event(scenario, "outage", moments)
    cover = Event(scenario, "cover", moments)
    # A look shows what an earlier one showed from the same place, unless something has changed.
    known: dict[tuple[Any, ...], MarkerView | None] = {}
    for look in _looks(placed, _waits_until_s(flight, scenario)):
        present = environment_at(scenario, flight, look.time_s)
        if present != shown:
            renderer.change(present)
            shown, known = present, {}
        if outage.happens(look.time_s):
            continue
        eye = eye_under(looks_at(camera, look.place_m, look.height_m), LEVEL, camera.offset_m)
        poses = tuple(_pose(item, look.time_s) for item in flight.objects)
        sight = eye, poses, cover.happens(look.time_s)
        if sight not in known:
            known[sight] = renderer.render(eye, attitude, look.time_s, poses).marker
        if (marker := known[sight]) is None:
            continue
        views.append(
            NominalView(
                time_s=look.time_s,
                duration_s=look.duration_s,
                place=look.place,
                height_m=look.height_m,
                marker=marker,
                attempt=look.attempt,
            )
        )
    return tuple(views)


def with_nominal_landing(flight: Flight, placed: Placed, camera: Camera) -> Flight:
    """Return the flight with what a nominal landing takes, and sees if this one was given up."""
    given_up = flight.outcome in ("gave_up", "not_landed")
    return dataclasses.replace(
        flight,
        nominal_views=nominal_views(flight, placed, camera) if given_up else (),
        nominal_arrival_s=nominal_arrival_s(placed),
        nominal_landing_s=nominal_landing_s(placed),
    )


def _waits_until_s(flight: Flight, scenario: Scenario) -> float:
    """Return until when a nominal landing may try again; 0 if it would see the same again.

    What covers the marker, a camera that fails, and bodies come and go, and only bodies change the
    weather.
    """
    comes_and_goes = any(scenario[f"{event}.lasts_s"] > 0 for event in ("cover", "outage"))
    if not comes_and_goes and not flight.objects:
        return 0.0
    given_up = (each.time_s for each in flight.events if each.name == "abort_command")
    return next(given_up, flight.elapsed_s)


def _looks(placed: Placed, until_s: float) -> Iterator[_Look]:
    """Yield the looks in the order of time, none longer than ``_LONGEST_LOOK_S``."""
    for look in _stays(placed, until_s):
        count = math.ceil(look.duration_s / _LONGEST_LOOK_S)
        for index in range(count):
            yield dataclasses.replace(
                look,
                time_s=look.time_s + (index + 0.5) * look.duration_s / count,
                duration_s=look.duration_s / count,
            )


def _stays(placed: Placed, until_s: float) -> Iterator[_Look]:
    """Yield where a nominal landing stays, from when on, and for how long.

    The first attempt is always whole; a further one has its touchdown by ``until_s``.
    """
    told, marker, start = placed.told_m, placed.marker_m, placed.start_m
    turns = [2 * math.pi * index / RING_PLACES for index in range(RING_PLACES)]
    ring = [(told[0] + RING_M * math.cos(a), told[1] + RING_M * math.sin(a)) for a in turns]
    now = _up_s(start[2]) + _across_s(start[:2], told)
    stay_s = 2 * RING_M * math.sin(math.pi / RING_PLACES) / SEARCH_MPS
    for place in (told, *ring):
        yield _Look(
            time_s=now,
            duration_s=stay_s,
            place="search",
            place_m=place,
            height_m=SEARCH_ALTITUDE_M,
            attempt=0,
        )
        now += stay_s
    now += _across_s(ring[-1], marker)
    for attempt in itertools.count():
        if attempt and now + _descent_s(SIGHT_HEIGHTS_M[0]) > until_s:
            return
        yield from _descent(now, marker, attempt)
        now += (SIGHT_HEIGHTS_M[0] - SLOW_BELOW_M) * (1 / DESCENT_MPS + 1 / CLIMB_MPS)


def _descent(now: float, marker: Place, attempt: int) -> Iterator[_Look]:
    """Yield the stays of a descent that begins above the marker."""
    # Each height stands for the way about it: from halfway above to halfway below.
    middles = [(high + low) / 2 for high, low in itertools.pairwise(SIGHT_HEIGHTS_M)]
    tops, ends = (SIGHT_HEIGHTS_M[0], *middles), (*middles, SLOW_BELOW_M)
    for height, top, end in zip(SIGHT_HEIGHTS_M, tops, ends, strict=True):
        took_s = (top - end) / DESCENT_MPS
        yield _Look(
            time_s=now,
            duration_s=took_s,
            place="above",
            place_m=marker,
            height_m=height,
            attempt=attempt,
        )
        now += took_s


def _descent_s(height_m: float) -> float:
    """Return what a descent to the ground takes: half the speed near the ground."""
    slow_s = (SLOW_BELOW_M - LAND_BELOW_M) / (DESCENT_MPS / 2)
    return (height_m - SLOW_BELOW_M) / DESCENT_MPS + slow_s


def _up_s(height_m: float) -> float:
    """Return what the climb to the search height takes, with all starting and stopping."""
    return STARTS_AND_STOPS_S - min(height_m, SEARCH_ALTITUDE_M) / CLIMB_MPS


def _across_s(start: Place, goal: Place) -> float:
    return math.dist(start, goal) / CRUISE_MPS


def _pose(item: ObjectRecord, time_s: float) -> BodyPose:
    """Return where an object was, at the last sample that is not later than a time."""
    track = item.track
    index = track.index_at(time_s)
    x, y, z = (float(value) for value in track.position_m[index])
    _, _, turn_z, turn_w = (float(value) for value in track.attitude[index])
    return (x, y, z), 2 * math.atan2(turn_z, turn_w)
