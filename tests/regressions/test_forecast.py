from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.regressions.case_flights import ESCAPE_FLIGHTS
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
    assert flights_after_search(20, 12, 8) < 20 + 12
    assert (
        flights_after_search(20, 12, 8)
        <= flights_after_search(20, 12, 80)
        <= flights_after_search(20, 12, None)
    )


LAWN = load_map("lawn")
GENOME = genome_for(LAWN)


def kind(
    number: int, *, cap: int | None, budget: int = 12, crash: str = "", signature: str = "IV:dog"
) -> CaseRequest:
    scenario = decode(GENOME.nominal, GENOME, map="lawn", seed=number)
    result = flight_result(crash=broken(crash) if crash else None)
    done = CompletedFlight(result=result, sha256="", record=Path("none"))
    job: Any = None
    return CaseRequest(
        name=f"search {number}",
        signature=signature,
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
    cap = 2 * MINIMUM_CASE_FLIGHTS + 1
    assert budgets(*(kind(number, cap=cap) for number in range(4))) == [
        MINIMUM_CASE_FLIGHTS,
        MINIMUM_CASE_FLIGHTS,
        0,
        0,
    ]


def test_cap_that_reaches_all_kinds_is_spread_evenly() -> None:
    given = budgets(*(kind(number, cap=54) for number in range(6)))
    assert given == [9, 9, 9, 9, 9, 9]


def test_lowest_cap_reaches_one_kind() -> None:
    assert budgets(kind(0, cap=1), kind(1, cap=1)) == [12, 0]


def test_exceptions_leave_flights_for_other_kinds() -> None:
    cap = 2 * EXCEPTION_FLIGHTS + MINIMUM_CASE_FLIGHTS
    kinds = [kind(n, cap=cap, crash="nonsense" if n < 2 else "") for n in range(3)]
    assert budgets(*kinds) == [EXCEPTION_FLIGHTS, EXCEPTION_FLIGHTS, MINIMUM_CASE_FLIGHTS]


def test_kind_without_escape_needs_fewer_flights() -> None:
    least = MINIMUM_CASE_FLIGHTS - ESCAPE_FLIGHTS
    kinds = [kind(n, cap=2 * least, signature=f"off:{n}") for n in range(3)]
    assert budgets(*kinds) == [least, least, 0]


def test_unspent_flights_reach_other_kinds() -> None:
    wanted = [kind(number, cap=2 * MINIMUM_CASE_FLIGHTS) for number in range(3)]
    assert budgets(*wanted) == [MINIMUM_CASE_FLIGHTS, MINIMUM_CASE_FLIGHTS, 0]
    spent = CaseResult(signature="0", case=None, flights=4)
    (last,) = divide_flights(wanted[2:], {"search 0": spent, "search 1": spent})
    assert last.budget == 2 * MINIMUM_CASE_FLIGHTS - 8
