from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.shrinking.new_case import case_without_flights
from pytest_garl.triage.second_reading import NOTHING_ALONE, TRIED, case_of_finding
from tests.cases.samples import OBJECT_NAMES, make_case_request, violating_scenario
from tests.support.results import flight_result

ELSEWHERE, OFF = "off:descending-elsewhere", "off:unseen"


class Flights:
    """Stands for the simulator: in fog the UAV comes down beside the marker."""

    def __init__(self, fog: float) -> None:
        self.fog = fog
        self.flown: list[Scenario] = []

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        self.flown.append(scenario)
        off = scenario["environment.fog"] > self.fog
        result = self.off() if off else flight_result()
        return CompletedFlight(result=result, sha256="cd" * 32, record=Path("/nowhere/x"))

    @staticmethod
    def off() -> FlightResult:
        return flight_result(OFF, outcome="landed", primary="distance", violation_type="off")


def request(budget: int = 40, known: tuple[str, ...] = ()) -> CaseRequest:
    fogs = (0.12, 0.08, 0.1, 0.14)
    scenarios = [
        violating_scenario(seed).replace({"environment.fog": fog}) for seed, fog in enumerate(fogs)
    ]
    return dataclasses.replace(
        make_case_request(budget, *scenarios),
        name=f"search {ELSEWHERE}",
        signature=ELSEWHERE,
        finding=ELSEWHERE,
        known=known,
    )


def test_a_scenario_that_fails_without_npcs_becomes_an_ordinary_case() -> None:
    fly = Flights(fog=0.02)
    result = case_of_finding(request(), fly)
    assert result.case is not None
    assert set(fly.flown[0].removed_objects) == set(OBJECT_NAMES)
    assert result.case.violation.signature == result.signature == OFF
    assert result.finding == ELSEWHERE
    assert set(result.case.scenario.removed_objects) == set(OBJECT_NAMES)
    assert result.case.scenario["environment.fog"] < 0.08
    assert result.flights == len(fly.flown) <= 40


def test_a_finding_that_shows_nothing_alone_makes_no_case() -> None:
    fly = Flights(fog=1.0)
    result = case_of_finding(request(), fly)
    assert (result.case, result.reason) == (None, NOTHING_ALONE)
    assert result.flights == len(fly.flown) == TRIED


def test_a_later_flight_counts_if_the_first_shows_nothing() -> None:
    fly = Flights(fog=0.1)
    result = case_of_finding(request(), fly)
    assert result.case is not None
    assert not case_of_finding(request(budget=1), Flights(fog=0.1)).case


def test_a_violation_that_gets_a_case_anyway_makes_no_second_one() -> None:
    fly = Flights(fog=0.02)
    result = case_of_finding(request(known=(OFF,)), fly)
    assert result.case is None
    assert f"it fails as {OFF}" in result.reason
    assert len(fly.flown) == 1


@pytest.mark.parametrize("budget", range(1, 30))
def test_a_finding_keeps_its_budget(budget: int) -> None:
    fly = Flights(fog=0.02)
    result = case_of_finding(request(budget), fly)
    assert result.flights == len(fly.flown) <= budget


def test_a_finding_without_flights_left_is_no_case() -> None:
    result = case_without_flights(request())
    assert result.case is None
    assert "no flights are left" in result.reason
