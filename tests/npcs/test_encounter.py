"""Whether an NPC meets a UAV on its recorded way, and whether the UAV sees it before."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest

from pytest_garl import Airframe
from pytest_garl.flight.flight import Track
from pytest_garl.npcs.decision_rules import Intercepting
from pytest_garl.npcs.encounter import (
    Encounter,
    Passage,
    begins_at,
    could_be_prevented,
    first_seen_s,
    in_picture,
)
from pytest_garl.npcs.interference import Interfering
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed, start_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, with_all_values

LAWN = dataclasses.replace(load_map("lawn"), bodies=(), objects=(("person", 1),))
PERSON = OBJECT_TYPES["person"]
CHASING = functools.partial(Interfering, "chasing", Intercepting())
SINKS_MPS = 0.8


def scenario_with(away_m: float, speed: float = 0.5) -> Scenario:
    """Return a scenario with a person who stands east of the marker and may chase the UAV."""
    genome = genome_for(LAWN)
    scenario = decode(genome.nominal, genome, map="lawn", seed=1)
    values = {"grade": float(GRADES.index("chasing")), "lasts_s": 5.0}
    x, y = Placed(scenario, LAWN).marker_m
    genes = dict(scenario.genes) | with_all_values(values, "person-1", "person")
    genes |= start_genes("person-1", (x + away_m, y), LAWN) | {"person-1.velocity": speed}
    return dataclasses.replace(scenario, genes=tuple(genes.items()))


def descent(scenario: Scenario, until_s: float = 12.0) -> Track:
    """Return the way of a UAV that sinks from 10 m above the marker and stops on the ground."""
    times = np.arange(0.0, until_s, 1 / 24)
    x, y = Placed(scenario, LAWN).marker_m
    height = np.maximum(0.2, 10.0 - SINKS_MPS * times)
    ones = np.ones_like(times)
    return Track(
        time_s=times,
        position_m=np.stack([x * ones, y * ones, height], axis=1),
        attitude=np.stack([0 * ones, 0 * ones, 0 * ones, ones], axis=1),
        velocity_mps=np.stack([0 * ones, 0 * ones, np.where(height > 0.2, -SINKS_MPS, 0)], axis=1),
    )


def passage(scenario: Scenario) -> Passage:
    return Passage(descent(scenario), scenario, LAWN, "person-1", Airframe(), CHASING)


def test_a_body_is_in_the_picture_as_far_as_the_camera_looks() -> None:
    level = descent(scenario_with(5.0))
    place = level.position_m * np.array([1, 1, 0])
    camera = Airframe().camera
    # 90 degrees wide: as far to the side as it is deep; the nose, the picture's top, points east.
    for aside, forward, shown in ((5.0, 0.0, True), (11.0, 0.0, False), (0.0, 9.0, False)):
        body = place + np.array([forward, aside, 0.0])
        assert in_picture(level, body, PERSON, camera)[0] == shown
    tilt = math.radians(30)
    attitude = np.tile([0.0, -math.sin(tilt / 2), 0.0, math.cos(tilt / 2)], (len(place), 1))
    nose_up = dataclasses.replace(level, attitude=attitude)
    assert in_picture(nose_up, place + np.array([9.0, 0.0, 0.0]), PERSON, camera)[0], (
        "it looks ahead"
    )
    assert not in_picture(nose_up, place - np.array([5.0, 0.0, 0.0]), PERSON, camera)[0]


def test_a_body_is_seen_with_its_second_frame() -> None:
    way = descent(scenario_with(5.0))
    shown = np.zeros(len(way.time_s), dtype=bool)
    assert first_seen_s(way, shown) is None
    shown[[24, 48, 49, 50, 51, 52]] = True
    seen_s = first_seen_s(way, shown)
    assert seen_s == pytest.approx(2.0 + 3 / 24)
    assert first_seen_s(way, shown, since_s=2.1) is None


def test_a_uav_needs_time_to_notice_and_to_escape() -> None:
    assert could_be_prevented(10.0, 8.7)
    assert not could_be_prevented(10.0, 8.8)
    assert not could_be_prevented(10.0, None)


@pytest.mark.parametrize(
    ("contact_s", "seen_s", "until_s", "meets"),
    [
        (5.0, None, math.inf, True),
        (5.0, 6.0, math.inf, True),
        (5.0, 4.0, math.inf, None),
        (None, 4.0, math.inf, None),
        (None, None, math.inf, False),
        (5.0, None, 4.0, None),
        (None, None, 4.0, None),
    ],
)
def test_what_is_known_ends_when_the_uav_sees_it(
    contact_s: float | None, seen_s: float | None, until_s: float, meets: bool | None
) -> None:
    found = Encounter(moment_s=1.0, contact_s=contact_s, seen_s=seen_s, nearest_m=0.0)
    assert found.meets(until_s) is meets


def test_an_npc_meets_a_uav_if_it_begins_in_time() -> None:
    # The UAV is as low as its head after 10.3 s, and has landed after 12 s.
    with passage(scenario_with(6.0)) as way:
        found = {moment_s: way.begin_at(moment_s) for moment_s in (0.0, 6.5, 11.0)}
    assert found[0.0].contact_s is None, "it has left again"
    assert found[6.5].contact_s == pytest.approx(10.9, abs=0.3)
    assert found[6.5].nearest_m < 1.0
    assert found[6.5].seen_s is not None
    assert found[11.0].contact_s is None
    assert found[11.0].nearest_m > 4.0


def test_a_moment_is_a_begin_of_the_story() -> None:
    told = begins_at(scenario_with(6.0), "person-1", 7.5)
    story = Placed(told, LAWN).npc("person-1").story
    assert story is not None
    assert story.begins_s((0.0, math.inf, math.inf, math.inf)) == 7.5
