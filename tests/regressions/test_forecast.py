from __future__ import annotations

import pytest

from pytest_garl.regressions.forecast import flights_after_search, remaining_work
from tests.regressions.test_flight_shares import kind


def test_forecast_divides_the_time_by_the_workers_up_to_the_longest_kind() -> None:
    kinds = [kind(number, cap=None) for number in range(4)]
    times = {each.name: 2.0 for each in kinds}
    alone = remaining_work(kinds, times, 1)
    assert remaining_work(kinds, times, 2).seconds == pytest.approx(alone.seconds / 2)
    assert remaining_work(kinds, times, 100).seconds == pytest.approx(alone.seconds / 4)
    assert remaining_work((), {}, 2).seconds == 0
    assert remaining_work(kinds, times, 1).flights == remaining_work(kinds, times, 2).flights


def test_flights_after_search_stay_below_the_cap() -> None:
    assert flights_after_search(0, 12, 40) == flights_after_search(3, 0, 40) == 0
    assert flights_after_search(2, 12, None) == 2 * flights_after_search(1, 12, None)
    assert flights_after_search(20, 12, 8) < 20 + 12 + 4
    assert (
        flights_after_search(20, 12, 8)
        <= flights_after_search(20, 12, 80)
        <= flights_after_search(20, 12, None)
    )
