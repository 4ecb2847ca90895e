from __future__ import annotations

import dataclasses
import math
from collections import Counter

import numpy as np
import pytest

from pytest_garl.npcs.encodings import ACTIONS, ENCODINGS, on_turn
from pytest_garl.npcs.interference import Belief
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import Move
from tests.support.situations import SCENARIO, being, situation


def test_the_papers_state_is_object_and_uav_relative_to_the_marker() -> None:
    seen = situation(being((3.0, -1.0)), uav=(5.0, 6.0, 9.0), marker=(1.0, 2.0))
    assert ENCODINGS["paper"].state(seen) == pytest.approx([0.2, -0.3, 0.4, 0.4])


def test_the_extended_state_adds_height_speed_step_and_size() -> None:
    seen = situation(being((3.0, -1.0), "bird", 8.0), uav=(5.0, 6.0, 9.0), marker=(1.0, 2.0))
    assert ENCODINGS["extended"].state(seen)[4:] == pytest.approx(
        [0.9, -0.5, 1.0, 3.1 / 3, 2.9 / 3]
    )


def test_the_relative_state_is_the_same_from_all_sides() -> None:
    encoding = ENCODINGS["relative"]

    def turned(angle: float) -> tuple[np.ndarray, list[tuple[float, float]]]:
        def at(x: float, y: float) -> tuple[float, float]:
            cos, sin = math.cos(angle), math.sin(angle)
            return cos * x - sin * y, sin * x + cos * y

        seen = situation(
            being(at(4.0, 3.0)),
            uav=(*at(1.0, -2.0), 7.0),
            marker=at(0.5, 0.5),
            others=(being(at(2.0, 2.0), name="other"),),
        )
        moves = [at(m.x, m.y) for m in encoding.moves(seen)]
        # Turned back, moves are what they were.
        back = [
            (
                math.cos(2 * angle) * x + math.sin(2 * angle) * y,
                -math.sin(2 * angle) * x + math.cos(2 * angle) * y,
            )
            for x, y in moves
        ]
        return encoding.state(seen), back

    state, moves = turned(0.0)
    for angle in (0.7, 2.0, -1.3):
        other, others = turned(angle)
        assert other == pytest.approx(state, abs=1e-6)
        assert np.array(others) == pytest.approx(np.array(moves), abs=1e-9)


def test_ahead_is_towards_the_uavs_column() -> None:
    seen = situation(being((4.0, 3.0)), uav=(1.0, -1.0, 7.0))
    ahead = ENCODINGS["relative"].moves(seen)[3]
    assert (ahead.x, ahead.y) == pytest.approx((-0.6, -0.8))
    assert ENCODINGS["paper"].moves(seen) == ACTIONS


def conditions(**genes: float) -> Scenario:
    return SCENARIO.replace({f"environment.{name}": value for name, value in genes.items()})


def test_the_online_rival_sees_places_weather_light_and_the_markers_genes() -> None:
    scenario = conditions(fog=0.15, road_snow=0.075, sun_position=0.25)
    scenario = scenario.replace({"marker.x": -0.5, "marker.y": 1.0})
    seen = situation(being((2.0, -3.0)), uav=(4.0, 4.0, 9.0), scenario=scenario)
    state = ENCODINGS["online"].state(seen)
    assert state[:4] == pytest.approx(ENCODINGS["paper"].state(seen))
    assert state[4:] == pytest.approx([0, 1, 0, 0, 0, 0, 0, 0.5, 0.25, -0.5, 1.0])


def test_the_online_rival_has_the_papers_23_actions() -> None:
    encoding = ENCODINGS["online"]
    moves = encoding.moves(situation(being((2.0, -3.0)), scenario=conditions(fog=0.05, dust=0.08)))
    assert len(moves) == encoding.actions == 23
    assert moves[:5] == ACTIONS
    dust_up, dust_down, fog_up, fog_down = moves[5:9]
    assert dust_up == Move(x=0.0, y=0.0, changes=(("environment.dust", 0.01),))
    assert dust_down.changes == (("environment.dust", -0.01),)
    assert (fog_up.changes, fog_down.changes) == (
        (("environment.fog", 0.01),),
        (("environment.fog", -0.01),),
    )
    assert moves[-1].changes == (("environment.sun_position", -0.01),)


def test_the_online_rival_keeps_to_the_confined_range() -> None:
    def fog(value: float) -> list[float]:
        moves = ENCODINGS["online"].moves(situation(being((0, 0)), scenario=conditions(fog=value)))
        return [by for move in moves for key, by in move.changes if key == "environment.fog"]

    assert fog(0.145) == pytest.approx([0.005, -0.01])
    assert fog(0.15) == [-0.01]
    assert fog(0.7) == [-0.01]
    assert fog(0.004) == pytest.approx([0.01, -0.004])
    assert fog(0.0) == [0.01]


def test_one_npc_is_drawn_for_each_decision() -> None:
    names = ["bird-1", "dog-1", "person-1", "person-2"]
    turns: Counter[str] = Counter()
    for marker in ((1.0, 2.0), (-3.0, 0.5)):
        drawn = []
        for step in range(200):
            every = [being((0.0, 0.0), name=name) for name in names]
            acting = []
            for me in every:
                others = tuple(other for other in every if other is not me)
                seen = situation(me, marker=marker, others=others)
                if on_turn(dataclasses.replace(seen, time_s=0.5 * step)):
                    acting.append(me.name)
            assert len(acting) == 1
            drawn += acting
        turns.update(drawn)
    assert min(turns.values()) > 70
    assert on_turn(situation(being((0.0, 0.0))))


@pytest.mark.parametrize("name", ENCODINGS)
def test_states_are_bounded_and_have_their_declared_size(name: str) -> None:
    seen = situation(being((4000.0, -3000.0)), uav=(1e6, 0.0, 500.0))
    if name == "belief":
        facts = {each.name: getattr(seen, each.name) for each in dataclasses.fields(seen)}
        seen = Belief(**facts, left_s=5e3, keeps_m=2.0)
    state = ENCODINGS[name].state(seen)
    assert state.shape == (ENCODINGS[name].size,)
    assert np.abs(state).max() <= 10.0
