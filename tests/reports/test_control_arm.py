"""The control arm: which flights are random, what they found, and as many of the later flights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.plugin.terminal.summary import search_table
from pytest_garl.reports.control_arm import LEAST_FLIGHTS, control_arm, is_control
from pytest_garl.reports.run_markdown import _flights
from pytest_garl.reports.run_reading import kinds_of
from pytest_garl.reports.run_record import SearchRecord
from tests.support.results import flight_result, repeated

DOG, BIRD, LOST = "IV:dog:descent:seen", "IV:bird:descent:seen", "II:lost:descent"


def flights(*generations: Sequence[str]) -> list[LedgerFlight]:
    """Return the flights of generations, each given by its signatures."""
    return [
        LedgerFlight(
            id=FlightId(search="s", map="lawn", slot=Slot(generation=generation, index=index)),
            system="my_landing:Mine",
            scenario="",
            result=flight_result(signature),
            sha256="",
        )
        for generation, signatures in enumerate(generations)
        for index, signature in enumerate(signatures)
    ]


def record(
    flown: list[LedgerFlight], method: Any = "garl", own: Sequence[str] = ()
) -> SearchRecord:
    stories: dict[str, list[tuple[str, str]]] = {}
    for each in flown:
        if each.signature:
            stories.setdefault(each.signature, []).append((each.id.slot_id, "A story."))
    for slot in own:
        stories.setdefault("own:test_it:1234", []).append((slot, "too slow"))
    random = {each.id.slot_id for each in flown if is_control(method, each.id.slot.generation)}
    control = control_arm(method, flown)
    key = SearchKey(system="my_landing:Mine", map="lawn", tests=("test_it.py::test_it",))
    return SearchRecord(
        key=key,
        name=key.place,
        flights=tuple(flown),
        kinds=kinds_of(stories, random_slots=random if control else None),
        violating=0,
        control=control,
    )


def text(*generations: Sequence[str]) -> str:
    return record(flights(*generations)).told["control"]


@pytest.mark.parametrize("method", ["random", "garl-paper", "ga", "mine:Garl", "", None, 3])
def test_other_methods_have_no_control_arm(method: Any) -> None:
    assert control_arm(method, flights([DOG] * 40, [DOG] * 40)) is None
    assert "control" not in record(flights([DOG] * 40, [DOG]), method).told


def test_generation_0_of_garl_is_the_control_arm() -> None:
    arm = control_arm("garl", flights([DOG, "", ""], [BIRD, DOG, LOST], [DOG]))
    assert arm is not None
    assert (arm.random.flights, arm.random.counts) == (3, (1,))
    assert (arm.later.flights, arm.later.counts) == (4, (2, 1, 1))


def test_flights_are_compared_at_the_number_of_the_smaller_arm() -> None:
    random, later = [DOG] * 5 + [""] * 35, [DOG] * 100 + [BIRD] * 50 + [LOST] * 2 + [""] * 208
    # 1 - C(358, 40) / C(360, 40) of the flights' draws show the rare kind.
    assert text(random, later[:180], later[180:]) == (
        "at equal flights: the 40 random ones (generation 0) found 1 kind; 40 picked from the 360 "
        "later ones find 2.2 on average, 2 to 3 in 95 % of picks"
    )
    assert text(later[:30] + [""] * 30, random[:20]) == (
        "at equal flights: 20 picked from the 60 random ones (generation 0) find 1.0 on average, "
        "1 to 1 in 95 % of picks; the 20 later ones found 1 kind"
    )


def test_random_flights_that_are_too_few_decide_nothing() -> None:
    few = [""] * (LEAST_FLIGHTS - 1)
    assert text(few, [DOG] * 99) == (
        "against random flights: too few random flights to say (19 of 20)"
    )
    assert text([*few, ""], [DOG] * 10) == (
        "against random flights: too few later flights to say (10 of 20)"
    )
    assert "too few" not in text([*few, ""], [DOG] * 20)
    arm = control_arm("garl", flights(few, [DOG] * 99))
    assert arm is not None
    assert arm.at_equal_flights is None


def test_budget_within_the_first_generation_leaves_nothing_to_compare() -> None:
    assert text([DOG] * 30) == "all 30 flights are random: nothing to compare them with"


def test_killed_search_counts_the_flights_that_it_has() -> None:
    arm = control_arm("garl", flights([DOG, BIRD]))
    assert arm is not None
    assert (arm.random.flights, arm.later.flights) == (2, 0)


def test_assertions_of_the_user_are_left_out_of_the_comparison_but_counted_by_kind() -> None:
    search = record(flights([DOG] * 20, [""] * 20), own=("lawn-g00-s00", "lawn-g01-s00"))
    assert search.control is not None
    assert search.control.random.kinds == 1
    assert search.told["control"].endswith("(assertions of your own left out)")
    assert {kind.signature: kind.in_control for kind in search.kinds} == {
        DOG: 20,
        "own:test_it:1234": 1,
    }


def test_table_says_of_each_kind_in_how_many_random_flights_it_was_seen() -> None:
    search = record(flights([DOG, ""], [BIRD, BIRD, BIRD]))
    lines = [line.strip() for line in search_table(search, repeated, 120)]
    assert "2 kinds of violation, as diverse as 1.8 equally frequent ones" in lines
    assert "seen in 1 of 2 random flights" in lines
    assert "seen in 0 of 2 random flights" in lines
    assert [_flights(kind) for kind in search.kinds] == [
        "3 (0 of 2 random)",
        "1 (1 of 2 random)",
    ]
    other = record(flights([DOG, ""], [BIRD, BIRD, BIRD]), "random")
    assert "random flights" not in "\n".join(search_table(other, repeated, 120))
    assert [_flights(kind) for kind in other.kinds] == ["3", "1"]


def test_one_kind_alone_has_no_diversity() -> None:
    assert record(flights([DOG, DOG]), "random").remarks == ()
