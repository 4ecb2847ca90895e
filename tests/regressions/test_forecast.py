from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.regressions.case_flights import PILOT_FLIGHTS
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.forecast import divide_flights, flights_after_search, remaining_work
from pytest_garl.regressions.investigation import EXCEPTION_FLIGHTS, MINIMUM_CASE_FLIGHTS
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from tests.support.results import crash as broken
from tests.support.results import flight_result


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


LAWN = load_map("lawn")
GENOME = genome_for(LAWN)


def kind(number: int, *, cap: int | None, budget: int = 12, crash: str = "") -> CaseRequest:
    scenario = decode(GENOME.nominal, GENOME, map="lawn", seed=number)
    result = flight_result(crash=broken(crash) if crash else None)
    done = CompletedFlight(result=result, sha256="", record=Path("none"))
    job: Any = None
    return CaseRequest(
        name=f"search {number}",
        signature=str(number),
        violations=((scenario, done),),
        job=job,
        map=LAWN,
        budget=budget,
        cap=cap,
    )


def budgets(*kinds: CaseRequest) -> list[int]:
    return [each.budget for each in divide_flights(kinds)]


@pytest.mark.parametrize("cap", [None, 100])
def test_each_kind_has_all_its_flights_under_a_high_cap(cap: int | None) -> None:
    kinds = [kind(0, cap=cap), kind(1, cap=cap, crash="raised"), kind(2, cap=cap, crash="hung")]
    assert budgets(*kinds) == [12, EXCEPTION_FLIGHTS, EXCEPTION_FLIGHTS]


def test_low_cap_reaches_as_many_kinds_as_possible_and_keeps_the_rest() -> None:
    own = MINIMUM_CASE_FLIGHTS - PILOT_FLIGHTS
    cap = 2 * own + 1
    assert budgets(*(kind(number, cap=cap) for number in range(4))) == [
        MINIMUM_CASE_FLIGHTS,
        MINIMUM_CASE_FLIGHTS,
        0,
        0,
    ]


def test_cap_that_reaches_all_kinds_is_spread_evenly() -> None:
    given = budgets(*(kind(number, cap=40) for number in range(6)))
    assert given == [10, 10, 10, 10, 9, 9]
    assert sum(each - PILOT_FLIGHTS for each in given) == 40


def test_lowest_cap_reaches_one_kind() -> None:
    assert budgets(kind(0, cap=1), kind(1, cap=1)) == [12, 0]


def test_exceptions_leave_flights_for_other_kinds() -> None:
    own = MINIMUM_CASE_FLIGHTS - PILOT_FLIGHTS
    cap = 2 * EXCEPTION_FLIGHTS + own
    kinds = [kind(n, cap=cap, crash="nonsense" if n < 2 else "") for n in range(3)]
    assert budgets(*kinds) == [EXCEPTION_FLIGHTS, EXCEPTION_FLIGHTS, MINIMUM_CASE_FLIGHTS]


def test_unspent_flights_reach_other_kinds_without_those_of_the_pilot() -> None:
    own = MINIMUM_CASE_FLIGHTS - PILOT_FLIGHTS
    wanted = [kind(number, cap=2 * own) for number in range(3)]
    assert budgets(*wanted) == [MINIMUM_CASE_FLIGHTS, MINIMUM_CASE_FLIGHTS, 0]
    spent = CaseResult(
        signature="0", case=None, flights=4 + PILOT_FLIGHTS, pilot_flights=PILOT_FLIGHTS
    )
    done = {"search 0": spent, "search 1": spent}
    left = 2 * own - 8
    (last,) = divide_flights(wanted[2:], done)
    assert last.budget == (left + PILOT_FLIGHTS if left >= own else 0)
