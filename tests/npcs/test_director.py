"""When an NPC that waits begins."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_garl.npcs.director import (
    AT,
    FEATURES,
    WAITING,
    LearnedDirector,
    TimeToGo,
    Watch,
    spare_s,
)
from pytest_garl.npcs.gradient import untrained
from pytest_garl.npcs.learned import Network
from pytest_garl.scenarios.story import Story
from pytest_garl.simulation.npc_policy import Situation
from tests.support.situations import MAP, being, situation

CHASING = Story(grade="chasing", lasts_s=4.0)
PLACE = dataclasses.replace(MAP, bodies=())


def person(
    x: float,
    uav: tuple[float, float, float] = (0.0, 0.0, 10.0),
    climb: float = 0.0,
    time_s: float = 0.0,
) -> Situation:
    """Return the situation of a person of 2 m/s east of a marker at the origin."""
    return dataclasses.replace(
        situation(being((x, 0.0)), uav=uav),
        uav_velocity_mps=(0.0, 0.0, climb),
        time_s=time_s,
        map=PLACE,
    )


def seen(watch: Watch, moment: Situation, times: int = 3) -> np.ndarray:
    """Return the numbers after some equal situations, half a second apart."""
    for number in range(times):
        row = watch.look(dataclasses.replace(moment, time_s=moment.time_s + 0.5 * number))
    return row


def number(row: np.ndarray, name: str) -> float:
    return float(row[AT[name]])


def test_an_npc_knows_of_the_uav_what_its_grade_perceives() -> None:
    near, far = person(5.0, (0.0, 0.0, 6.0)), person(25.0)
    watch = Watch(near, CHASING)
    assert number(watch.look(near), "sees") == 0, "it sees half a second late"
    row = seen(watch, near)
    assert number(row, "sees") == 1
    assert number(row, "distance") == pytest.approx(0.5)
    assert number(row, "height") == pytest.approx(0.6)
    row = seen(Watch(far, CHASING), far)
    assert number(row, "sees") == number(row, "distance") == number(row, "height") == 0
    assert number(row, "from_marker") == pytest.approx(2.5)


def test_the_numbers_say_who_waits_and_for_how_long() -> None:
    moment = person(5.0, time_s=10.0)
    row = seen(Watch(moment, CHASING), moment, times=5)
    assert number(row, "chasing") == 1
    assert number(row, "curious") == 0
    assert number(row, moment.self.type.name) == 1
    assert number(row, "lasts") == pytest.approx(4.0 / 5)
    assert number(row, "since_start") == pytest.approx(12.0 / 20)
    assert number(row, "since_sight") == pytest.approx(2.0 / 20), "seen with the second decision"
    assert number(row, "since_3_m") == 0
    low = dataclasses.replace(moment, moments_s=(0.0, 8.0, 9.0, math.inf))
    row = seen(Watch(low, CHASING), low, times=1)
    assert number(row, "since_8_m") > number(row, "since_3_m") > 0


def test_they_tell_what_the_uav_did_in_the_last_decisions() -> None:
    moment = person(5.0, (0.0, 0.0, 6.0))
    watch = Watch(moment, CHASING)
    for climb in (0.0, 0.0, 1.0, -1.0, 0.0):
        row = watch.look(dataclasses.replace(moment, uav_velocity_mps=(0.0, 0.0, climb)))
    # The last one has not reached its mind.
    assert number(row, "climbed") == pytest.approx(1 / 4)
    assert number(row, "held") == pytest.approx(2 / 4)


def test_only_grades_that_see_the_uav_in_part_wait_for_a_director() -> None:
    with pytest.raises(ValueError, match="'careless', expected an NPC"):
        Watch(person(5.0), Story(grade="careless"))


def test_the_rule_goes_when_the_npc_can_meet_the_uav_in_time() -> None:
    rule = TimeToGo(margin_s=0.0)
    start = person(6.0)
    watch, went = Watch(start, CHASING), None
    for step in range(40):
        uav = (0.0, 0.0, max(0.2, 10.0 - 0.5 * step))
        moment = dataclasses.replace(
            start, time_s=0.5 * step, uav_position_m=uav, uav_velocity_mps=(0.0, 0.0, -1.0)
        )
        if rule.decides(watch.look(moment)):
            went = uav[2]
            break
    assert went is not None
    speed = start.self.speed_mps
    assert went - start.self.top_m == pytest.approx(6.0 / speed, abs=0.6), "1 m/s down"


def test_the_rule_waits_for_a_uav_that_flies_in_or_holds() -> None:
    rule = TimeToGo(margin_s=0.0)
    low = person(6.0, (0.0, 0.0, 2.0))
    sinking = person(6.0, (0.0, 0.0, 2.0), -1.0)
    assert rule.decides(seen(Watch(sinking, CHASING), sinking))
    assert not rule.decides(seen(Watch(low, CHASING), low)), "it takes off"
    away = dataclasses.replace(sinking, marker_position_m=(9.0, 0.0))
    assert not rule.decides(seen(Watch(away, CHASING), away))


def test_one_that_sees_nothing_goes_some_time_after_the_uav_is_low() -> None:
    far = person(25.0, time_s=12.0)
    low = dataclasses.replace(far, moments_s=(0.0, 8.0, 10.0, math.inf))
    for after_s, goes in ((1.0, True), (2.0, True), (2.5, False)):
        row = Watch(low, CHASING).look(low)
        assert TimeToGo(unseen_s=after_s).decides(row) is goes
    assert not TimeToGo().decides(Watch(far, CHASING).look(far))


def test_a_network_decides_by_the_larger_value() -> None:
    row = np.zeros(len(FEATURES))
    for bias, goes in (((0.2, 0.1), False), ((0.1, 0.2), True), ((0.1, 0.1), False)):
        layers = ((np.zeros((2, len(FEATURES))), np.array(bias)),)
        director = LearnedDirector(network=Network(state=WAITING, layers=layers))
        assert director.decides(row) is goes
    network = untrained(WAITING, (len(FEATURES), 16, 2), seed=0)
    assert LearnedDirector(network=network).decides(row) in (True, False)


def test_time_to_spare_is_that_of_the_descent_less_that_of_the_way() -> None:
    me = being((6.0, 0.0))
    spare = spare_s(4.0 + me.top_m, -2.0, 6.0, me)
    assert spare == pytest.approx(2.0 - 6.0 / me.speed_mps)
    assert spare_s(4.0 + me.top_m, 0.0, 0.0, me) == pytest.approx(20.0), "it does not sink"
