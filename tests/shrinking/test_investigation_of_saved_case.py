from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.cases.case_file import size_of
from pytest_garl.execution.reference import BUILT_IN, simulator_sha256
from pytest_garl.execution.severity import Severity
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_comparison import no_worse, simplicity
from pytest_garl.shrinking.investigation import NO_LONGER_REPRODUCED, simplify_case
from pytest_garl.shrinking.plan import FEWEST_FOR_SAVED_CASE
from pytest_garl.shrinking.robustness import neighbours
from tests.cases.samples import (
    COLLIDING_OBJECT,
    JOB,
    LAWN,
    OBJECT_NAMES,
    VIOLATING_SCENARIO,
    FakeFlights,
    make_case_request,
)
from tests.cases.samples import case as dog_case


def saved(scenario: Scenario, *, neighbours_failed: int = 3) -> Case:
    evidence = dataclasses.replace(
        dog_case().evidence,
        system_sha256=JOB.system_sha256,
        simulator_sha256=simulator_sha256(BUILT_IN),
        neighbours_failed=neighbours_failed,
        removed="0 of 4 objects, 1 of 15 conditions",
    )
    names = [name for name in OBJECT_NAMES if name not in scenario.removed_objects]
    moves = tuple((name, ((0.0, 0.0), (0.5, -0.25))) for name in names)
    return dataclasses.replace(
        dog_case(), scenario=scenario, moves=moves, evidence=evidence, policy="stationary"
    )


def shrunk(
    case: Case, fails: Callable[[Scenario, str], bool], flights: int = 60
) -> tuple[Case | None, int]:
    fly = FakeFlights(fails)
    result = simplify_case(make_case_request(flights), fly, case)
    assert result.flights == fly.count <= flights
    return result.case, fly.count


def by_record(scenario: Scenario, npcs: str) -> bool:
    return npcs == "recorded" and COLLIDING_OBJECT not in scenario.removed_objects


def test_saved_case_is_shrunk_from_its_own_record() -> None:
    case = saved(VIOLATING_SCENARIO)
    better, _ = shrunk(case, by_record)
    assert better is not None
    assert set(better.scenario.removed_objects) == {*OBJECT_NAMES} - {COLLIDING_OBJECT}
    assert better.moves == ((COLLIDING_OBJECT, dict(case.moves)[COLLIDING_OBJECT]),)
    assert better.scenario["environment.fog"] == 0.0
    assert better.evidence.removed.startswith("3 of 4 objects, ")
    assert no_worse(simplicity(better, LAWN), simplicity(case, LAWN))


def test_saved_case_is_shrunk_by_the_policy_if_its_record_gives_nothing_simpler() -> None:
    records = {VIOLATING_SCENARIO}

    def fails(scenario: Scenario, npcs: str) -> bool:
        # A record strikes only where it was made; a policy strikes wherever that object is.
        if npcs == "recorded":
            near = [neighbour for each in records for neighbour in neighbours(each, LAWN)]
            return scenario in records or scenario in near
        records.add(scenario)
        return COLLIDING_OBJECT not in scenario.removed_objects

    better, _ = shrunk(saved(VIOLATING_SCENARIO), fails)
    assert better is not None
    assert set(better.scenario.removed_objects) == {*OBJECT_NAMES} - {COLLIDING_OBJECT}


@pytest.mark.parametrize("seed", range(30))
def test_simpler_case_is_worse_in_no_respect(seed: int) -> None:
    chance = random.Random(seed)
    answers: dict[tuple[Scenario, str], bool] = {}

    def fails(scenario: Scenario, npcs: str) -> bool:
        likely = chance.random() < 0.6
        return scenario == VIOLATING_SCENARIO or answers.setdefault((scenario, npcs), likely)

    case = saved(VIOLATING_SCENARIO, neighbours_failed=chance.randrange(4))
    better, flights = shrunk(case, fails, chance.randrange(FEWEST_FOR_SAVED_CASE, 50))
    assert flights >= 1
    if better is not None:
        one, other = simplicity(better, LAWN), simplicity(case, LAWN)
        assert no_worse(one, other)
        assert one != other or size_of(better, LAWN) < size_of(case, LAWN)


def test_case_that_fails_only_as_it_is_stays() -> None:
    better, _ = shrunk(
        saved(VIOLATING_SCENARIO), lambda scenario, _: scenario == VIOLATING_SCENARIO
    )
    assert better is None


def test_evidence_of_other_sources_is_renewed() -> None:
    case = saved(VIOLATING_SCENARIO)
    old = dataclasses.replace(case.evidence, simulator_sha256="00" * 32)
    around = (VIOLATING_SCENARIO, *neighbours(VIOLATING_SCENARIO, LAWN))
    better, _ = shrunk(
        dataclasses.replace(case, evidence=old), lambda scenario, _: scenario in around
    )
    assert better is not None
    assert (better.id, better.scenario) == (case.id, case.scenario)
    assert better.evidence.simulator_sha256 == simulator_sha256(BUILT_IN)
    assert better.evidence.neighbours_failed == 3


@pytest.mark.parametrize("as_it_fails", [False, True])
def test_a_case_that_fails_in_another_way_becomes_one_of_that_only_if_asked(
    as_it_fails: bool,
) -> None:
    case = dataclasses.replace(saved(VIOLATING_SCENARIO, neighbours_failed=1), accepted=True)
    around = (VIOLATING_SCENARIO, *neighbours(VIOLATING_SCENARIO, LAWN))
    fly = FakeFlights(lambda scenario, _: scenario in around, "II:lost:descent")
    request = make_case_request(60)
    result = simplify_case(request, fly, case, as_it_fails=as_it_fails)
    if not as_it_fails:
        assert (result.case, result.reason, fly.count) == (None, NO_LONGER_REPRODUCED, 1)
        return
    assert result.case is not None
    assert result.signature == result.case.violation.signature == "II:lost:descent"
    assert result.case.scenario == case.scenario
    assert result.case.evidence.neighbours_failed == 3
    assert (result.case.status, result.case.accepted) == ("open", True)
    assert result.flights == fly.count == 4


def test_a_case_that_passes_becomes_no_other_one() -> None:
    fly = FakeFlights(lambda scenario, _: False)
    case = saved(VIOLATING_SCENARIO)
    result = simplify_case(make_case_request(60), fly, case, as_it_fails=True)
    assert (result.case, result.reason) == (None, NO_LONGER_REPRODUCED)


def test_crossing_with_a_window_is_not_shrunk_further() -> None:
    crossing = dataclasses.replace(
        saved(VIOLATING_SCENARIO),
        severity=Severity(about="body", grade="careless", type="person", window_s=2.0),
    )
    assert shrunk(crossing, by_record) == (None, 1)
