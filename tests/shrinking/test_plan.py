from __future__ import annotations

import pytest

from pytest_garl.shrinking.plan import (
    CONFIRM_FLIGHTS,
    NEIGHBOURS,
    flights_to_shrink_collision,
    flights_to_shrink_saved_case,
    flights_to_shrink_without_collision,
)


@pytest.mark.parametrize("left", range(60))
def test_shrinking_leaves_flights_for_the_steps_after_it(left: int) -> None:
    for has_moves in (False, True):
        flights = flights_to_shrink_collision(left, has_moves=has_moves)
        assert flights == 0 or 2 <= flights <= left - CONFIRM_FLIGHTS - (left // 3) * has_moves
    flights = flights_to_shrink_without_collision(left)
    assert flights == 0 or 1 <= flights <= left - 2 * NEIGHBOURS
    flights = flights_to_shrink_saved_case(left, is_last=True)
    assert flights == 0 or 1 <= flights <= left - CONFIRM_FLIGHTS


def test_first_attempt_at_a_saved_case_leaves_half_for_the_next() -> None:
    assert flights_to_shrink_saved_case(40, is_last=True) == 40 - 2 * CONFIRM_FLIGHTS
    assert flights_to_shrink_saved_case(40, is_last=False) == (40 - 2 * CONFIRM_FLIGHTS) // 2
