from __future__ import annotations

import math

import numpy as np
import pytest

from pytest_garl.adversary.states import ACTIONS, VIEWS
from tests.adversary.situations import being, situation


def test_the_papers_state_is_object_and_uav_relative_to_the_marker() -> None:
    seen = situation(being((3.0, -1.0)), uav=(5.0, 6.0, 9.0), marker=(1.0, 2.0))
    assert VIEWS["paper"].state(seen) == pytest.approx([0.2, -0.3, 0.4, 0.4])


def test_the_extended_state_adds_what_timing_needs() -> None:
    seen = situation(being((3.0, -1.0), "bird", 8.0), uav=(5.0, 6.0, 9.0), marker=(1.0, 2.0))
    assert VIEWS["extended"].state(seen)[4:] == pytest.approx([0.9, -0.5, 1.0, 3.1 / 3, 2.9 / 3])


@pytest.mark.parametrize("name", ["relative", "fellow"])
def test_a_relative_state_is_the_same_from_all_sides(name: str) -> None:
    view = VIEWS[name]

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
        moves = [at(m.x, m.y) for m in view.moves(seen)]
        # Turned back, moves are what they were.
        back = [
            (
                math.cos(2 * angle) * x + math.sin(2 * angle) * y,
                -math.sin(2 * angle) * x + math.cos(2 * angle) * y,
            )
            for x, y in moves
        ]
        return view.state(seen), back

    state, moves = turned(0.0)
    for angle in (0.7, 2.0, -1.3):
        other, others = turned(angle)
        assert other == pytest.approx(state, abs=1e-6)
        assert np.array(others) == pytest.approx(np.array(moves), abs=1e-9)


def test_ahead_is_towards_the_uavs_column() -> None:
    seen = situation(being((4.0, 3.0)), uav=(1.0, -1.0, 7.0))
    ahead = VIEWS["relative"].moves(seen)[3]
    assert (ahead.x, ahead.y) == pytest.approx((-0.6, -0.8))
    assert VIEWS["paper"].moves(seen) == ACTIONS


def test_alone_the_fellow_is_far_away() -> None:
    assert VIEWS["fellow"].state(situation(being((4.0, 3.0))))[-2:] == pytest.approx([-2.0, 0.0])


@pytest.mark.parametrize("name", VIEWS)
def test_states_are_bounded_and_as_long_as_they_say(name: str) -> None:
    seen = situation(being((4000.0, -3000.0)), uav=(1e6, 0.0, 500.0))
    state = VIEWS[name].state(seen)
    assert state.shape == (VIEWS[name].size,)
    assert np.abs(state).max() <= 10.0
