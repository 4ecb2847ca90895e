from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.cases.case import (
    NOT_ASKED,
    Preventable,
    Prevention,
    RecordedBehaviour,
)
from pytest_garl.cases.case_file import dump_case, parse_case
from pytest_garl.cases.replay import replay
from pytest_garl.cases.user_failure import UserFailure
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.severity import Severity
from pytest_garl.flight.flight_file import save
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_request import FailingScenario
from pytest_garl.shrinking.new_case import case_without_flights, new_case
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.cases.samples import (
    COLLIDING_OBJECT,
    LAWN,
    OBJECT_NAMES,
    SIGNATURE,
    VIOLATING_SCENARIO,
    make_case_request,
    result_of,
)

DQN = policy_spec("dqn")
REQUEST = make_case_request(10, VIOLATING_SCENARIO)
SIMPLE = VIOLATING_SCENARIO.without(*OBJECT_NAMES[1:])
FAILING = FailingScenario(
    origin=VIOLATING_SCENARIO,
    scenario=SIMPLE,
    behaviour=RecordedBehaviour(moves=((COLLIDING_OBJECT, ((0.5, 0.0),)),)),
    flight=REQUEST.violations[0][1],
    neighbours_failed=2,
    neighbours_flown=3,
)


def test_case_holds_scenario_moves_and_evidence() -> None:
    made = new_case(REQUEST, FAILING)
    assert (made.scenario, made.moves) == (SIMPLE, FAILING.behaviour.moves)
    assert (made.status, made.live, made.prevention) == ("open", False, NOT_ASKED)
    assert made.violation.signature == SIGNATURE
    assert (made.evidence.neighbours_failed, made.evidence.neighbours) == (2, 3)
    assert made.evidence.removed.startswith(
        f"{len(OBJECT_NAMES) - 1} of {len(OBJECT_NAMES)} objects, "
    )
    assert (made.edge, made.gates, made.reason) == (True, False, "edge")


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ("preventable", ""),
        ("sensor-limited", "sensor-limited"),
        ("unpreventable", "unpreventable"),
    ],
)
def test_case_gates_only_what_was_preventable(answer: Preventable, reason: str) -> None:
    robust = dataclasses.replace(FAILING, neighbours_failed=3)
    found = Prevention(answer=answer, inevitable_s=1.0)
    made = new_case(REQUEST, robust, found)
    assert (made.reason, made.prevention) == (reason, found)
    assert new_case(REQUEST, FAILING, found).reason == "edge"


def test_case_is_live_if_its_escape_holds_against_a_policy_that_reads_the_uav() -> None:
    found = Prevention(answer="preventable", inevitable_s=1.0)
    assert not new_case(REQUEST, FAILING, found).live
    chased = dataclasses.replace(REQUEST.job, npcs=policy_spec("dqn"))
    assert new_case(dataclasses.replace(REQUEST, job=chased), FAILING, found).live


def test_case_of_an_own_assertion_describes_its_failure() -> None:
    failure = UserFailure(
        test="test_own", assertion="1234", message="too late", attributes=frozenset()
    )

    def assertion(flight: CompletedFlight, scenario: Scenario) -> UserFailure:
        return failure

    made = new_case(dataclasses.replace(REQUEST, user_assertion=assertion), FAILING)
    assert (made.violation.type, made.violation.signature) == ("own", "own:test_own:1234")
    assert made.violation.description.startswith("test_own: too late. ")
    assert (made.test, made.assertion) == ("test_own", "1234")


def test_case_without_flights_is_the_simplest_violation() -> None:
    result = case_without_flights(make_case_request(10, VIOLATING_SCENARIO, SIMPLE))
    assert result.case is not None
    assert result.case.scenario == SIMPLE
    assert (result.flights, result.case.evidence.neighbours) == (0, 0)


@pytest.mark.sim
def test_case_without_flights_has_the_flight_of_the_search_in_its_file(tmp_path: Path) -> None:
    """Moves of few digits would be another flight, and nobody has flown it."""
    flight = fly(VIOLATING_SCENARIO, ReferencePilot, policy_spec("greedy"), map=LAWN)
    save(flight, tmp_path / "flight.npz")
    found = CompletedFlight(
        result=result_of(SIGNATURE), sha256=flight.sha256, record=tmp_path / "flight.npz"
    )
    request = dataclasses.replace(REQUEST, violations=((VIOLATING_SCENARIO, found),))
    made = case_without_flights(request).case
    assert made is not None
    pilot = f"{ReferencePilot.__module__}:{ReferencePilot.__qualname__}"
    text = dump_case(dataclasses.replace(made, system=pilot))
    assert replay(parse_case(text, load_map), tmp_path).same_flight is True


def test_case_of_a_crossing_gates_if_its_entry_has_a_window() -> None:
    careless = policy_spec("careless")
    crossing = dataclasses.replace(FAILING, npcs=careless, window_s=1.0)
    severity = Severity(about="body", grade="careless", type="person", objects=1)
    result = dataclasses.replace(FAILING.flight.result, severity=severity)
    flown = dataclasses.replace(FAILING.flight, result=result)
    made = new_case(REQUEST, dataclasses.replace(crossing, flight=flown))
    assert (made.reason, made.policy) == ("", "careless")
    assert made.severity == dataclasses.replace(severity, window_s=1.0)
    assert made.robustness == "it collides too if the body comes at another time within 1 s"
    edge = new_case(REQUEST, dataclasses.replace(crossing, window_s=0.0))
    assert edge.reason == "edge"


def test_preventable_crossing_is_not_flown_with_a_live_policy() -> None:
    chased = dataclasses.replace(REQUEST, job=dataclasses.replace(REQUEST.job, npcs=DQN))
    crossing = dataclasses.replace(FAILING, npcs=policy_spec("careless"), window_s=2.0)
    found = Prevention(answer="preventable", inevitable_s=1.0)
    assert not new_case(chased, crossing, found).live
