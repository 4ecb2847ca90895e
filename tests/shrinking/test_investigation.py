from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_garl.cases.case import RecordedBehaviour
from pytest_garl.flight.flight_file import save
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.shrinking.case_flights import CaseFlights
from pytest_garl.shrinking.case_request import CaseResult, FailingScenario
from pytest_garl.shrinking.investigation import NOT_REPRODUCED, Investigation, build_case
from pytest_garl.shrinking.plan import FEWEST_FOR_VIOLATION, NEIGHBOURS
from pytest_garl.shrinking.robustness import neighbours
from tests.cases.samples import (
    LAWN,
    OBJECT_NAMES,
    VIOLATING_SCENARIO,
    FakeFlights,
    make_case_request,
    violating_scenario,
)
from tests.support.recorded_flights import recorded, seen


@pytest.mark.parametrize("seed", range(40))
def test_investigation_keeps_its_budget(seed: int) -> None:
    chance = random.Random(seed)
    share, budget = chance.random(), chance.randrange(FEWEST_FOR_VIOLATION, 40)
    fly = FakeFlights(lambda *_: chance.random() < share)
    scenarios = [violating_scenario(seed=100 * seed + number) for number in range(4)]
    result = build_case(make_case_request(budget, *scenarios), fly)
    assert result.flights == fly.count <= budget


def test_investigation_steps_back_until_all_neighbours_fail() -> None:
    def fails(scenario: Scenario, npcs: str) -> bool:
        # On the edge: near nominal fog it fails at round values alone.
        fog = scenario["environment.fog"]
        return fog >= 0.04 or (0 < fog < 0.04 and round(fog, 2) == fog)

    result = build_case(make_case_request(60, VIOLATING_SCENARIO), FakeFlights(fails))
    assert result.case is not None
    assert result.case.evidence.neighbours_failed == 3
    assert result.case.scenario["environment.fog"] >= 0.04


LATE = "late:no-time"


def late_case(fails: Callable[[Scenario], bool], budget: int = 12) -> CaseResult:
    """Return the result of an investigation of late landings in bad weather."""
    fly = FakeFlights(lambda scenario, _: fails(scenario), signature=LATE)
    request = make_case_request(budget, VIOLATING_SCENARIO, signature=LATE)
    result = build_case(request, fly)
    assert result.flights == fly.count <= budget
    return result


def test_failure_without_a_collision_is_shrunk_to_one_condition_and_robust() -> None:
    result = late_case(lambda each: each["environment.fog"] >= 0.04)
    assert result.case is not None
    scenario = result.case.scenario
    assert {*scenario.removed_objects} == {*OBJECT_NAMES}
    assert [each.cause for each in active_conditions(scenario)] == ["fog"]
    assert 0.04 <= scenario["environment.fog"] < 0.12
    assert result.case.evidence.neighbours_failed == NEIGHBOURS
    assert result.case.reason == ""


def test_failure_on_an_edge_steps_back_to_a_robust_one() -> None:
    def fails(scenario: Scenario) -> bool:
        fog = scenario["environment.fog"]
        return fog >= 0.1 or (fog > 0 and round(fog / 0.03, 6).is_integer())

    result = late_case(fails)
    assert result.case is not None
    assert result.case.scenario["environment.fog"] >= 0.1
    assert {*result.case.scenario.removed_objects} == {*OBJECT_NAMES}
    assert result.case.reason == ""


OUTAGE = {"outage.after": 2.0, "outage.from_s": 4.0, "outage.lasts_s": 2.0}
"""The camera fails 4 s after the UAV passes 3 m."""


@pytest.mark.parametrize(("within_s", "reason"), [(0.03, "edge"), (0.7, "")])
def test_failure_at_the_exact_second_of_an_event_is_an_edge_case(
    within_s: float, reason: str
) -> None:
    def fails(scenario: Scenario, npcs: str) -> bool:
        follows = scenario["outage.after"] == 2.0 and scenario["outage.lasts_s"] > 1
        return follows and abs(scenario["outage.from_s"] - 4.0) <= within_s

    fly = FakeFlights(fails, signature=LATE)
    found = VIOLATING_SCENARIO.replace(OUTAGE)
    result = build_case(make_case_request(30, found, signature=LATE), fly)
    assert result.case is not None
    assert result.case.scenario["outage.after"] == 2.0
    assert result.case.reason == reason
    assert (result.case.evidence.neighbours_failed == NEIGHBOURS) == (not reason)


def test_failure_with_everything_nominal_keeps_no_condition() -> None:
    result = late_case(lambda _: True, budget=20)
    assert result.case is not None
    assert active_conditions(result.case.scenario) == ()


def test_failure_that_is_not_repeated_is_no_case() -> None:
    result = late_case(lambda _: False)
    assert result.case is None
    assert result.reason == NOT_REPRODUCED


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("budget", [8, 12, 30])
def test_failure_without_a_collision_keeps_the_budget(seed: int, budget: int) -> None:
    chance = random.Random(seed)
    late_case(lambda _: chance.random() < 0.5, budget)


BEHAVIOUR = RecordedBehaviour(moves=((OBJECT_NAMES[0], ((0.5, 0.0),)),))
HISTORY = [VIOLATING_SCENARIO.without(*OBJECT_NAMES[count:]) for count in (3, 2, 1)]


def reduce(fails: set[Scenario], at_least: int = 0) -> FailingScenario | None:
    investigation = Investigation(
        make_case_request(60, VIOLATING_SCENARIO), FakeFlights(lambda each, _: each in fails)
    )
    return investigation.simplest_robust(
        VIOLATING_SCENARIO, HISTORY, lambda _: BEHAVIOUR, at_least=at_least
    )


def test_simplest_robust_steps_back_from_an_edge() -> None:
    complex_, middle, simple = HISTORY
    around = {*neighbours(middle, LAWN)}
    for fails, kept in (
        ({*HISTORY} | around, middle),
        ({*HISTORY} | around | {*neighbours(simple, LAWN)}, simple),
        ({*HISTORY, *neighbours(complex_, LAWN)}, complex_),
    ):
        found = reduce(fails)
        assert found is not None
        assert found.scenario == kept


def test_simplest_robust_keeps_the_simplest_if_all_sit_on_an_edge() -> None:
    found = reduce({*HISTORY})
    assert found is not None
    assert (found.scenario, found.neighbours_failed) == (HISTORY[-1], 0)
    assert reduce({*HISTORY}, at_least=1) is None


def test_flight_without_a_record_has_no_shorter_one() -> None:
    request, fly = make_case_request(60, VIOLATING_SCENARIO), FakeFlights(lambda *_: True)
    failing = FailingScenario(
        origin=VIOLATING_SCENARIO,
        scenario=VIOLATING_SCENARIO,
        behaviour=BEHAVIOUR,
        flight=dict(request.violations)[VIOLATING_SCENARIO],
        neighbours_failed=1,
        neighbours_flown=NEIGHBOURS,
    )
    assert Investigation(request, fly).shorter_record(failing) is None
    assert fly.count == 0


def test_what_was_never_read_is_dropped_without_a_flight(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Depth that the system never read is no condition of a case, whatever the budget."""
    record = tmp_path / "flight.npz"
    save(dataclasses.replace(recorded(steps=seen(())), data_read=("image",)), record)
    scenario = VIOLATING_SCENARIO.replace({"depth.range_m": 7.8, "depth.holes_percent": 22.0})
    request = make_case_request(NEIGHBOURS + 2, scenario, signature=LATE)
    ((found, flight),) = request.violations
    request = dataclasses.replace(
        request, violations=((found, dataclasses.replace(flight, record=record)),)
    )
    flown: list[Scenario] = []

    def fails(each: Scenario, _: str) -> bool:
        flown.append(each)
        return True

    result = build_case(request, FakeFlights(fails, signature=LATE))
    assert result.case is not None
    assert all(each["depth.range_m"] == 100.0 for each in (*flown, result.case.scenario))
    assert "condition" in result.case.evidence.removed
    read = dataclasses.replace(recorded(steps=seen(())), data_read=("image", "depth_m"))
    save(read, record)
    assert CaseFlights(request, FakeFlights(fails)).without_idle(found) == found


def test_conditions_that_no_flight_tried_to_remove_are_named() -> None:
    request = make_case_request(40, VIOLATING_SCENARIO, signature=LATE)
    flights = CaseFlights(request, FakeFlights(lambda *_: False, signature=LATE))
    failing = FailingScenario(
        origin=VIOLATING_SCENARIO,
        scenario=VIOLATING_SCENARIO,
        behaviour=RecordedBehaviour(moves=()),
        flight=flights.live_flight(VIOLATING_SCENARIO),
    )
    everything = {each.cause for each in active_conditions(VIOLATING_SCENARIO)} | {*OBJECT_NAMES}
    everything |= {"the marker's place"}
    assert {*flights.untried(failing)} == everything
    # Without fog it does not fail, and without one object neither: both were tried.
    assert not flights.fails_live(
        repair(VIOLATING_SCENARIO.replace({"environment.fog": 0.0}), LAWN)
    )
    assert not flights.fails_live(repair(VIOLATING_SCENARIO.without(OBJECT_NAMES[1]), LAWN))
    assert {*flights.untried(failing)} == everything - {"fog", OBJECT_NAMES[1]}


def test_a_condition_of_which_no_flight_tried_a_value_is_named() -> None:
    turned = VIOLATING_SCENARIO.replace({"pad.yaw_deg": -152.0, "pad.worn_percent": 18.0})
    request = make_case_request(40, turned, signature=LATE)
    flights = CaseFlights(request, FakeFlights(lambda *_: False, signature=LATE))
    failing = FailingScenario(
        origin=turned,
        scenario=turned,
        behaviour=RecordedBehaviour(moves=()),
        flight=flights.live_flight(turned),
    )
    assert "each value of pad" not in flights.untried(failing), "the whole pad was not tried"
    level = turned.replace({"pad.yaw_deg": 0.0, "pad.worn_percent": 0.0})
    assert not flights.fails_live(repair(level, LAWN))
    assert "each value of pad" in flights.untried(failing)
    assert not flights.fails_live(repair(turned.replace({"pad.yaw_deg": 0.0}), LAWN))
    assert "each value of pad" not in flights.untried(failing)


def test_a_case_that_was_shrunk_to_its_end_names_nothing() -> None:
    result = late_case(lambda each: each["environment.fog"] >= 0.04, budget=60)
    assert result.case is not None
    assert result.case.severity.untried == ()
