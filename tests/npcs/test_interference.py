"""Curious and chasing NPCs perceive the UAV in part, interfere for a while, and leave."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_garl.npcs.decision_rules import Intercepting
from pytest_garl.npcs.grades import GRADE_LIMITS
from pytest_garl.npcs.interference import Belief, Interfering, Perception, Sighting, kept_away
from pytest_garl.scenarios.bodies import discs_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.npc_policy import STAY, Move
from tests.support.situations import being, situation
from tests.support.stories import TICK_S, scenario_with, walk

CURIOUS, CHASING = GRADE_LIMITS["curious"], GRADE_LIMITS["chasing"]
LAWN = load_map("lawn")


def perceived(limits_name: str, *uavs: tuple[float, float, float]) -> Sighting | None:
    """Return what an NPC at the origin perceives after decisions with the UAV at these places."""
    own = Perception(GRADE_LIMITS[limits_name], dataclasses.replace(LAWN, bodies=()))
    for place in uavs:
        own.update(situation(being((0.0, 0.0)), uav=place))
    return own.sighting


def test_the_uav_is_perceived_late() -> None:
    first, second, third = (1.0, 0.0, 5.0), (2.0, 0.0, 5.0), (3.0, 0.0, 5.0)
    assert perceived("chasing", first) is None
    seen = perceived("chasing", first, second, third)
    assert seen is not None
    assert seen.position_m == second
    seen = perceived("curious", first, second, third)
    assert seen is not None
    assert seen.position_m == first


def test_the_uav_is_perceived_from_near_only() -> None:
    for name, limits in GRADE_LIMITS.items():
        near, far = limits.sees_within_m - 2.0, limits.sees_within_m + 2.0
        assert perceived(name, *[(near, 0.0, 1.7)] * 4) is not None
        assert perceived(name, *[(far, 0.0, 1.7)] * 4) is None


def test_what_is_solid_hides_the_uav() -> None:
    disc = max((each for body in LAWN.bodies for each in discs_of(body)), key=lambda d: d.radius_m)
    beyond, here = disc.radius_m + 1.0, (disc.x_m - disc.radius_m - 1.0, disc.y_m)
    height = (disc.low_m + disc.high_m) / 2
    uav = (disc.x_m + beyond, disc.y_m, 2 * height - 1.66)
    for map, hidden in ((LAWN, True), (dataclasses.replace(LAWN, bodies=()), False)):
        own = Perception(CHASING, map)
        for _ in range(3):
            own.update(situation(being(here), uav=uav))
        assert (own.sighting is None) is hidden


def test_a_curious_one_does_not_go_under_the_rotors() -> None:
    seen = Sighting((3.0, 0.0, 5.0), (0.0, 0.0, 0.0), 1.0)
    east, west = Move(x=1.0, y=0.0), Move(x=-1.0, y=0.0)
    person = situation(being((0.9, 0.0), speed_mps=1.4))
    assert kept_away(east, seen, person, CURIOUS.keeps_m) == STAY
    assert kept_away(west, seen, person, CURIOUS.keeps_m) == west
    assert kept_away(east, seen, person, CHASING.keeps_m) == east
    bird = situation(being((0.9, 0.0), "bird", 8.0))
    assert kept_away(east, seen, bird, CURIOUS.keeps_m) == west


@pytest.mark.parametrize(("grade", "number"), [("curious", 1.0), ("chasing", 2.0)])
def test_it_interferes_for_its_time_and_leaves(grade: str, number: float) -> None:
    values = {"grade": number, "lasts_s": 4.0, "delay_s": 1.0}
    scenario = scenario_with("person-1", (-6.0, 0.0), 2.0, values)
    policy = Interfering(grade, Intercepting())
    places = walk(
        scenario, "person-1", seconds=30, policy=policy, uav=lambda time_s: (0.0, 0.0, 4.0)
    )
    distance = np.hypot(places[:, 0], places[:, 1])
    assert distance[: round(1.0 / TICK_S)].min() == pytest.approx(6.0, abs=0.01)
    assert distance.min() < (2.6 if grade == "curious" else 0.7)
    if grade == "curious":
        assert distance.min() > 1.0
    assert distance[-1] > 9.5


def test_a_chase_lasts_five_seconds_at_most() -> None:
    values = {"grade": 2.0, "lasts_s": 20.0}
    scenario = scenario_with("dog-1", (-8.0, 0.0), 6.0, values)
    policy = Interfering("chasing", Intercepting())
    places = walk(scenario, "dog-1", seconds=25, policy=policy, uav=lambda time_s: (0.0, 0.0, 3.0))
    under = np.hypot(places[:, 0], places[:, 1]) < 3.0
    assert 0 < under.sum() * TICK_S < 7.0
    assert np.hypot(*places[-1, :2]) > 9.5


def test_a_mind_is_told_what_the_npc_believes_and_not_the_truth() -> None:
    told: list[Belief] = []

    class Listening:
        def decide(self, belief: Belief) -> Move:
            told.append(belief)
            return STAY

    scenario = scenario_with("person-1", (-6.0, 0.0), 1.4, {"grade": 2.0, "lasts_s": 5.0})

    def uav(time_s: float) -> tuple[float, float, float]:
        return 0.5 * time_s, 0.0, 4.0

    walk(scenario, "person-1", seconds=4, policy=Interfering("chasing", Listening()), uav=uav)
    assert len(told) == 7
    for belief in told:
        # The UAV's velocity is 0 to the NPC, so that it believes it where it was.
        late = belief.time_s - CHASING.delay_s
        assert belief.uav_position_m == pytest.approx((0.5 * late, 0.0, 4.0))
        assert math.isfinite(belief.left_s)
