"""Moments of a landing come once, in the flight as in its record; events and NPCs wait for them."""

from __future__ import annotations

import dataclasses
from math import inf

import pytest

from pytest_garl import Command, Mission, Observation
from pytest_garl.flight.flight import Flight
from pytest_garl.scenarios.groups import MOMENTS
from pytest_garl.scenarios.story import STORY_MOMENTS
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.landing_moments import LandingMoments, RecordedMoments
from tests.support.flights import EMPTY, STAND, Hovers, Scripted, nominal
from tests.support.stories import NEVER, TICK_S, scenario_with, walk
from tests.verdicts.flights import CLEAR, FOGGY

READABLE, LOST = MOMENTS.index("readable"), MOMENTS.index("lost")


def began(*heights_m: float) -> tuple[float, ...]:
    """Return when each moment of the descent came if the UAV is at these heights, in seconds."""
    moments = LandingMoments()
    for second, height in enumerate(heights_m):
        moments.update(float(second), height)
    return moments.began_s[:READABLE]


def test_moments_come_when_the_uav_sinks_past_their_heights() -> None:
    assert began(0.0, 5.0, 10.0, 9.0, 7.9, 4.0, 2.9, 1.0, 0.0) == (0.0, 4.0, 6.0, 8.0)


def test_a_take_off_is_no_moment() -> None:
    assert began(0.0, 2.9, 3.0, 7.9, 8.0, 10.0) == (0.0, inf, inf, inf)


def test_a_uav_that_stays_low_passes_the_higher_height_with_the_lower_one() -> None:
    assert began(5.0, 4.0, 2.9) == (0.0, 2.0, 2.0, inf)


def test_a_moment_comes_once() -> None:
    assert began(10.0, 7.0, 10.0, 7.0)[1] == 1.0


def seen(*readable: bool) -> LandingMoments:
    """Return the moments after pictures at 4 Hz that could be read or not."""
    moments = LandingMoments()
    for number, each in enumerate(readable):
        moments.update(number / 4, 10.0)
        moments.see(number / 4, CLEAR if each else FOGGY)
    return moments


def test_the_marker_is_readable_from_the_first_picture_that_could_be_read() -> None:
    assert seen(False, False, True, True).began_s[READABLE:] == (0.5, inf)


def test_one_bad_picture_is_no_loss_and_a_half_second_is() -> None:
    assert seen(True, False, True, False, True).began_s[LOST] == inf
    assert seen(True, True, False, False, False).began_s[LOST] == 0.75


def test_a_marker_is_lost_once() -> None:
    lost = seen(True, False, False, False, True, True, False, False, False)
    assert lost.began_s[READABLE:] == (0.0, 0.5)


def test_a_marker_that_was_never_readable_is_not_lost() -> None:
    assert seen(*[False] * 8).began_s[READABLE:] == (inf, inf)


def test_a_record_flown_without_pictures_tells_its_moments_when_they_come() -> None:
    moments = LandingMoments([("readable", 1.5), ("lost", 3.0)])
    moments.update(1.0, 10.0)
    assert moments.began_s[READABLE:] == (inf, inf)
    moments.update(2.0, 10.0)
    assert moments.began_s[READABLE:] == (1.5, inf)


class Descends(Scripted):
    """Climbs over the marker, which lies at the mission's coordinate, and comes down slowly."""

    needs_camera = True

    def reset(self, mission: Mission) -> None:
        self.home = (*mission.gps_position_m, 0.0)

    def step(self, observation: Observation) -> Command:
        return self.hover(9.5 if observation.time_s < 10 else max(0.5, 19.5 - observation.time_s))


def landed(**conditions: float) -> Flight:
    return fly(nominal(**conditions), Descends, STAND, map=EMPTY, time_limit_s=20.0)


@pytest.mark.sim
def test_an_event_begins_after_its_moment() -> None:
    lasts = {"outage__lasts_s": 1.0, "outage__from_s": 0.5, "outage__after": 2.0}
    flight = landed(**lasts)
    low_s = dict(flight.moments)["3 m"]
    assert RecordedMoments(flight).began_s[2] == low_s
    black = [step.time_s for step in flight.steps if step.time_s > 8 and step.marker is None]
    assert low_s + 0.5 <= black[0] < low_s + 0.7
    assert low_s + 1.3 < max(each for each in black if each < low_s + 3) <= low_s + 1.6


@pytest.mark.sim
def test_an_event_whose_moment_does_not_come_does_not_happen() -> None:
    waits = {"jump__after": 3.0, "jump__distance_m": 3.0}
    hovering = fly(nominal(**waits), Hovers, STAND, map=EMPTY, time_limit_s=4.0)
    plain = fly(nominal(), Hovers, STAND, map=EMPTY, time_limit_s=4.0)
    assert hovering.sha256 == plain.sha256


@pytest.mark.sim
def test_the_position_jumps_after_its_moment() -> None:
    flight = landed(jump__after=1.0, jump__from_s=0.5, jump__distance_m=3.0)
    jumps_s = dict(flight.moments)["8 m"] + 0.5
    erring = [step.time_s for step in flight.steps if abs(step.estimation_error_m[0]) > 1]
    assert jumps_s <= erring[0] < jumps_s + 0.15


def test_an_npc_comes_when_it_can_just_meet_the_uav() -> None:
    met = float(STORY_MOMENTS.index("met"))
    scenario = scenario_with("person-1", (-8.0, 0.0), 2.0, {"grade": 0.0, "phase": met})

    def sinks(time_s: float) -> tuple[float, float, float]:
        return 0.0, 0.0, max(0.2, 10.2 - time_s)

    places = walk(
        scenario, "person-1", seconds=12, uav=sinks, uav_mps=(0.0, 0.0, -1.0), moments=(0.0, NEVER)
    )
    first_s = int((abs(places[:, 0] + 8.0) > 0.01).argmax()) * TICK_S
    # 8 m at 2 m/s take 4 s; the UAV's feet are a person's height above the ground after 8.3 s.
    assert 4.0 < first_s < 5.3
    still = walk(scenario, "person-1", seconds=12, uav=sinks, moments=(0.0, NEVER))
    assert still[-1, 0] == pytest.approx(-8.0)


@pytest.mark.sim
def test_the_moments_of_a_foreign_record_come_from_its_track() -> None:
    flight = fly(nominal(), Hovers, STAND, map=EMPTY, time_limit_s=0.5)
    bare = RecordedMoments(dataclasses.replace(flight, moments=()))
    assert bare.began_s == (0.0, *(inf for _ in MOMENTS[1:]))
    assert bare.of_npc("person-1")[-1] == inf
