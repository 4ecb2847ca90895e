from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.story import story_of
from pytest_garl.scenarios.validity import problems
from pytest_garl.shrinking.simplification import without_other_objects
from pytest_garl.shrinking.straight_crossing import (
    FARTHEST_M,
    Encounter,
    encounter_of,
    retimed_encounter,
    shifted,
    straight_crossing,
    walked_m,
)
from pytest_garl.simulation.fly import fly
from tests.cases.crossings import LAWN, NOMINAL, crossing, encounter
from tests.support.collisions import hits_a_person

PERSON = OBJECT_TYPES["person"]
MET = Encounter(
    name="person-1",
    type=PERSON,
    kind="person",
    time_s=18.2,
    place_m=(0.4, -0.3, 0.0),
    course_rad=0.3,
    speed_mps=2.6,
    uav_m=(0.4, -0.3, 1.2),
)


def test_walker_that_faces_its_way_gets_as_far_as_its_acceleration_lets_it() -> None:
    x, y = walked_m(PERSON, 1.4, 0.0, 5.0)
    assert x == pytest.approx(1.4 * 5 - 1.4**2 / (2 * PERSON.acceleration_mps2), abs=0.02)
    assert y == 0
    back, _ = walked_m(PERSON, 1.4, math.pi, 5.0)
    assert -x < back < -x + 1.4


def test_object_alone_starts_far_away_and_crosses_the_place_in_time() -> None:
    scenario = crossing(MET)
    story = story_of(scenario, "person-1")
    assert story is not None
    assert (story.grade, story.phase, story.pause_s) == ("careless", 0, 0.0)
    assert {*scenario.removed_objects} == {"person-2", "bird-1", "dog-1"}
    assert problems(scenario, LAWN) == ()
    marker, start = Placed(scenario, LAWN).marker_m, Placed(scenario, LAWN).npc("person-1").start_m
    place = marker[0] + story.crossing_m[0], marker[1] + story.crossing_m[1]
    assert math.dist(place, MET.place_m[:2]) < 2e-3
    assert FARTHEST_M - 1 < math.dist(start, place) <= FARTHEST_M
    assert story.delay_s % 0.5 == 0
    assert Placed(scenario, LAWN).npc("person-1").speed_mps == pytest.approx(1.4)
    course = math.atan2(place[1] - start[1], place[0] - start[0])
    dx, dy = walked_m(PERSON, 1.4, course, MET.time_s - story.delay_s)
    assert math.dist((start[0] + dx, start[1] + dy), place) < 0.15


@pytest.mark.parametrize(
    ("kind", "speed_mps", "usual_mps"),
    [
        ("person", 2.6, 1.4),
        ("person", 0.9, 0.9),
        ("person", 0.0, 0.5),
        ("child", 3.0, 2.0),
        ("dog", 7.0, 4.0),
        ("bird", 9.1, 9.1),
        ("bird", 0.0, 7.0),
    ],
)
def test_speed_is_a_usual_one_or_lower(kind: str, speed_mps: float, usual_mps: float) -> None:
    met = dataclasses.replace(MET, type=OBJECT_TYPES[kind], speed_mps=speed_mps)
    assert met.usual_speed_mps == usual_mps


def test_story_names_a_child() -> None:
    story = story_of(crossing(dataclasses.replace(MET, type=OBJECT_TYPES["child"])), "person-1")
    assert story is not None
    assert story.is_child


def test_low_bird_flies_at_the_height_of_the_contact() -> None:
    bird = dataclasses.replace(MET, name="bird-1", kind="bird", type=OBJECT_TYPES["bird"])
    low = dataclasses.replace(bird, place_m=(0.4, -0.3, 1.6), speed_mps=9.0)
    scenario = crossing(low)
    assert scenario["bird-1.height_m"] == 1.6
    assert scenario["bird-1.delay_s"] == pytest.approx(18.2 - 20 / 9, abs=1e-3)


def test_bird_cannot_come_before_the_flight() -> None:
    bird = dataclasses.replace(MET, name="bird-1", kind="bird", type=OBJECT_TYPES["bird"])
    early = dataclasses.replace(bird, time_s=1.0, speed_mps=9.0)
    alone = without_other_objects(NOMINAL, LAWN, "bird-1")
    assert straight_crossing(alone, early, LAWN) is None


def test_way_does_not_lead_through_something_solid() -> None:
    tree = next(body for body in LAWN.bodies if body.name.startswith("tree"))
    x, y, _ = tree.position_m
    # Straight behind the tree, as seen from the place.
    at = (x + 4.0, y)
    met = dataclasses.replace(MET, place_m=(*at, 0.0), course_rad=0.0)
    scenario = crossing(met)
    start = Placed(scenario, LAWN).npc("person-1").start_m
    assert 1.0 < start[0] - x < 2.0
    # So near that nobody can start in between.
    met = dataclasses.replace(met, place_m=(x + 1.0, y, 0.0))
    turned = Placed(crossing(met), LAWN).npc("person-1").start_m
    assert abs(math.atan2(y - turned[1], x + 1.0 - turned[0])) > 0.1


def test_entry_is_shifted_within_the_flight() -> None:
    scenario = crossing(MET)
    later = shifted(scenario, "person-1", 2.0, LAWN)
    assert later is not None
    assert later["person-1.delay_s"] == scenario["person-1.delay_s"] + 2.0
    assert shifted(scenario, "person-1", -99.0, LAWN) is None


@pytest.mark.sim
@pytest.mark.parametrize(
    ("name", "kind", "height_m", "speed_mps"),
    [
        ("person-1", "person", 1.0, 1.4),
        ("person-1", "child", 0.7, 3.0),
        ("dog-1", "dog", 0.3, 6.0),
        ("bird-1", "bird", 3.0, 9.0),
    ],
)
def test_straight_crossing_meets_a_uav_that_gives_way_to_nobody(
    name: str, kind: str, height_m: float, speed_mps: float
) -> None:
    met = encounter(name, kind, height_m, speed_mps=speed_mps)
    scenario = crossing(met)
    flight = fly(scenario, OpenCvLandingSystem, policy_spec("careless"), map=LAWN)
    assert flight.outcome == "collision"
    assert flight.contacts[-1].body == name
    assert flight.elapsed_s == pytest.approx(met.time_s, abs=0.6)
    again = encounter_of(flight, LAWN)
    assert again is not None
    assert (again.name, again.type.name) == (name, kind)
    assert math.cos(again.course_rad - met.course_rad) > 0.7


def test_flight_without_a_moving_body_met_nobody() -> None:
    from tests.verdicts.flights import flight, hit

    empty = flight("landed", (0.0, 0.0, 0.1))
    assert encounter_of(empty, LAWN) is None
    tree = dataclasses.replace(empty, contacts=hit("tree-1", "tree", "static"))
    assert encounter_of(tree, LAWN) is None
    # Some simulators record no objects.
    dog = dataclasses.replace(empty, contacts=hit("dog-1", "dog", "dynamic"))
    assert encounter_of(dog, LAWN) is None


@pytest.mark.parametrize(
    ("later_s", "aside_m", "again"),
    [(2.0, 0.4, True), (-2.0, 0.4, True), (0.2, 0.4, False), (2.0, 3.0, False)],
)
def test_encounter_is_retimed_if_the_uav_was_there_at_another_time(
    later_s: float, aside_m: float, again: bool
) -> None:
    met = dataclasses.replace(MET, time_s=10.0)
    missed = descends(there_s=met.time_s + later_s, aside_m=aside_m)
    found = retimed_encounter(met, missed)
    expected = dataclasses.replace(met, time_s=met.time_s + later_s) if again else None
    assert found == expected


def descends(there_s: float, aside_m: float) -> Flight:
    """Return a flight that is beside the place of ``MET`` at a time, and elsewhere before it."""
    x, y, z = MET.uav_m
    time_s = np.array([0.0, there_s - 1, there_s, there_s + 1])
    heights = np.array([z + 9, z + 5, z, z - 1])
    flight = hits_a_person()
    position_m = np.stack([np.full(4, x + aside_m), np.full(4, y), heights], axis=1)
    track = dataclasses.replace(flight.uav, time_s=time_s, position_m=position_m)
    return dataclasses.replace(flight, uav=track)
