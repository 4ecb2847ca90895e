from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import pytest

from pytest_garl.errors import BaselineError
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.gate.gate import compare_flights, compare_sets
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.robustness import neighbours
from tests.gate.samples import DOG, LAWN, baseline_set
from tests.support.results import flight_result


def test_sets_are_compared_by_scenario_and_refused_if_the_scenarios_differ() -> None:
    before, after = baseline_set(), baseline_set()
    broken = dataclasses.replace(after.flights[2], summary=DOG)
    after = dataclasses.replace(after, flights=(*after.flights[:2], broken))
    flown: list[Scenario] = []

    def fly(scenarios: Sequence[Scenario]) -> list[CompletedFlight]:
        flown.extend(scenarios)
        violation = flight_result(DOG.signature)
        return [CompletedFlight(result=violation, sha256="", record=Path())] * len(scenarios)

    found = compare_sets(before, after, LAWN, fly)
    assert [pair.text for pair in found.with_result("broke")] == [
        "lawn-2: landed -> IV:dog:descent:seen"
    ]
    # The type is new: the neighbours of its scenario are flown, and say that it is real.
    assert flown == list(neighbours(after.flights[2].scenario, LAWN))
    assert [each.text for each in found.new_types] == ["IV in lawn-2, in 3 of 3 neighbours"]
    assert [each.neighbours for each in found.new_types] == [((3, 3),)]
    with pytest.raises(BaselineError, match="did not fly the same scenarios"):
        compare_sets(before, baseline_set(2), LAWN, fly)


def test_the_gate_names_inconclusive_flights() -> None:
    unsure = flight_result(outcome="inconclusive")
    flights = [
        CompletedFlight(result=each, sha256="", record=Path())
        for each in (flight_result(), unsure, flight_result())
    ]
    found = compare_flights(baseline_set(), flights, LAWN, lambda _: [])
    assert found.failure_reasons == ("inconclusive: lawn-1",)
    assert [pair.name for pair in found.pairs] == ["lawn-0", "lawn-2"]
