"""Weaker adversaries are tried first: a straight careless crossing, then lower grades."""

from __future__ import annotations

import dataclasses
import random
from pathlib import Path

import pytest

from pytest_garl.cases.case_file import dump_case, parse_case
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.flight.flight_file import save
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, with_all_values
from pytest_garl.scenarios.validity import repair
from pytest_garl.shrinking.case_flights import CaseFlights
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.shrinking.investigation import build_case
from pytest_garl.shrinking.weaker_adversary import confirm_crossing, confirm_lower_grade
from tests.cases.crossings import LAWN, NOMINAL, RealFlights, crossing, encounter
from tests.cases.samples import JOB, collision_result
from tests.support.collisions import hits_a_person


def with_bystander(scenario: Scenario) -> Scenario:
    """Add a person who stands far away, and a little fog."""
    genes = {key: value for key, value in NOMINAL.genes if key.startswith("person-2.")}
    told = with_all_values({"grade": 0.0, "delay_s": 100.0}, "person-2", "person")
    both = dataclasses.replace(
        scenario,
        genes=(*scenario.genes, *(genes | told).items()),
        removed_objects=tuple(each for each in scenario.removed_objects if each != "person-2"),
    )
    return repair(both.replace({"environment.fog": 0.05}), LAWN)


@pytest.mark.sim
@pytest.mark.long
def test_case_of_a_collision_is_a_careless_crossing_alone_in_clear_weather(tmp_path: Path) -> None:
    flights = RealFlights(tmp_path)
    found = with_bystander(crossing(encounter("person-1", "person", 1.0)))
    request = flights.request(found)
    assert request.signature.startswith("IV:person:")
    result = build_case(request, flights)
    case = result.case
    assert case is not None
    assert result.flights == len(flights.policies) - 1 <= request.budget
    assert case.violation.signature == request.signature
    assert {*case.scenario.removed_objects} == {"person-2", "bird-1", "dog-1"}
    assert case.scenario["environment.fog"] == 0.0
    severity = case.severity
    assert (severity.grade, severity.type, severity.objects) == ("careless", "person", 1)
    assert severity.interference_s == 0.0
    assert 1.2 < severity.speed_mps <= 1.41
    assert severity.window_s is not None
    assert severity.window_s >= 1
    assert case.reason != "edge"
    assert (case.policy, case.live) == ("careless", False)
    assert case.violation.description.startswith("A careless person at 1.4 m/s enters from the ")
    text = dump_case(case)
    assert text.startswith("# A careless person at 1.4 m/s enters from the ")
    assert parse_case(text, lambda _: LAWN) == case


def test_window_ends_at_the_first_entry_that_does_not_fail(tmp_path: Path) -> None:
    flights = crossed(tmp_path, fails_until_s=1.0)
    found = confirm_crossing(flights, PERSON_ALONE)
    assert found is not None
    # One second earlier it is not hit, so two seconds earlier is not asked.
    assert (found.window_s, found.neighbours_failed, found.neighbours_flown) == (1.0, 1, 3)
    assert found.is_robust


def test_crossing_that_only_fails_in_its_moment_sits_on_an_edge(tmp_path: Path) -> None:
    found = confirm_crossing(crossed(tmp_path, fails_until_s=0.0), PERSON_ALONE)
    assert found is not None
    assert (found.window_s, found.is_robust) == (0.0, False)


def test_crossing_leaves_flights_for_the_scenario_as_found(tmp_path: Path) -> None:
    flights = crossed(tmp_path, fails_until_s=-1.0, budget=8)
    assert confirm_crossing(flights, PERSON_ALONE) is None
    assert (flights.flown, flights.left) == (1, 4)


def late(folder: Path, later_s: float) -> CompletedFlight:
    """Return a flight without collision, in which the UAV comes to the place so much later."""
    flight = hits_a_person()
    track = dataclasses.replace(flight.uav, time_s=flight.uav.time_s + later_s)
    record = folder / "missed.npz"
    save(dataclasses.replace(flight, uav=track, contacts=()), record)
    return flown("", record)


@pytest.mark.parametrize(
    ("grade", "budget", "flown_crossings"),
    [("careless", 12, 3), ("chasing", 12, 2), ("chasing", 13, 3)],
)
def test_crossing_is_timed_by_the_flight_that_missed_if_flights_are_left(
    tmp_path: Path, grade: str, budget: int, flown_crossings: int
) -> None:
    crossings: list[Scenario] = []

    def fly(job: FlightJob, scenario: Scenario) -> CompletedFlight:
        assert job.npcs.name == "careless"
        crossings.append(scenario)
        return late(tmp_path, 3.0)

    told = with_all_values({"grade": float(GRADES.index(grade))}, "person-1", "person")
    foggy = dataclasses.replace(PERSON_ALONE, genes=(*PERSON_ALONE.genes, *told.items()))
    found = repair(foggy.replace({"environment.fog": 0.1}), LAWN)
    flights = flights_after(tmp_path, found, fly, budget=budget)
    assert confirm_crossing(flights, found) is None
    assert len(crossings) == flown_crossings
    clear, *others = crossings
    again = [each for each in others if each["environment.fog"] == 0]
    assert len(again) == flown_crossings - 2
    assert others[-1]["environment.fog"] == 0.1
    for each in again:
        later_s = each["person-1.delay_s"] - clear["person-1.delay_s"]
        assert later_s == pytest.approx(3.0, abs=0.5)


def test_lower_grades_are_tried_downwards(tmp_path: Path) -> None:
    grades: list[str] = []

    def fly(job: FlightJob, scenario: Scenario) -> CompletedFlight:
        grade = GRADES[int(scenario["person-1.grade"])]
        if job.npcs.name == "graded":
            grades.append(grade)
        return flown("IV:person:descent:seen" if grade != "careless" else "")

    flights = chased(tmp_path, fly)
    found = confirm_lower_grade(flights, flights.request.scenarios[0])
    assert grades == ["curious", "careless"]
    assert found is not None
    assert found.scenario["person-1.grade"] == GRADES.index("curious")
    assert found.neighbours_failed == 3


def test_lower_grade_is_not_asked_of_a_policy_for_all_objects(tmp_path: Path) -> None:
    def fly(job: FlightJob, scenario: Scenario) -> CompletedFlight:
        raise AssertionError

    flights = chased(tmp_path, fly, policy="hostile")
    assert confirm_lower_grade(flights, flights.request.scenarios[0]) is None


def on_an_edge(recorded_fails: bool) -> FlyFunction:
    """Return flights in which a crossing fails in its moment only; others fail, or not at all."""
    delays_s: list[float] = []

    def fly(job: FlightJob, scenario: Scenario) -> CompletedFlight:
        fails = recorded_fails
        if any(key == "person-1.delay_s" for key, _ in scenario.genes):
            delays_s.append(scenario["person-1.delay_s"])
            fails = delays_s[-1] == delays_s[0]
        return flown("IV:person:descent:seen" if fails else "")

    return fly


def test_robust_scenario_is_kept_in_place_of_a_crossing_on_an_edge(tmp_path: Path) -> None:
    flights = flights_after(tmp_path, PERSON_ALONE, on_an_edge(recorded_fails=True))
    made = build_case(flights.request, on_an_edge(recorded_fails=True)).case
    assert made is not None
    assert (made.severity.window_s, made.reason) == (None, "")


def test_crossing_on_an_edge_is_kept_if_nothing_else_is_robust(tmp_path: Path) -> None:
    flights = flights_after(tmp_path, PERSON_ALONE, on_an_edge(recorded_fails=False))
    made = build_case(flights.request, on_an_edge(recorded_fails=False)).case
    assert made is not None
    assert (made.severity.window_s, made.reason) == (0.0, "edge")


@pytest.mark.parametrize("budget", range(8, 20))
@pytest.mark.parametrize("seed", range(5))
def test_flights_stay_within_the_budget(tmp_path: Path, budget: int, seed: int) -> None:
    chance, count = random.Random(seed), 0

    def fly(job: FlightJob, scenario: Scenario) -> CompletedFlight:
        nonlocal count
        count += 1
        return flown("IV:person:descent:seen" if chance.random() < 0.6 else "")

    told = with_all_values({"grade": 2.0, "lasts_s": 5.0}, "person-1", "person")
    chasing = dataclasses.replace(PERSON_ALONE, genes=(*PERSON_ALONE.genes, *told.items()))
    request = flights_after(tmp_path, repair(chasing, LAWN), fly, budget=budget).request
    assert build_case(request, fly).flights == count <= budget


def flown(signature: str, record: Path = Path("/nowhere/x")) -> CompletedFlight:
    result = dataclasses.replace(collision_result(signature), collisions=("person-1",))
    return CompletedFlight(result=result, sha256="", record=record)


PERSON_ALONE = NOMINAL.without("person-2", "bird-1", "dog-1")


def flights_after(
    folder: Path,
    scenario: Scenario,
    fly: FlyFunction,
    policy: str = "graded",
    budget: int = 12,
) -> CaseFlights:
    """Return the flights of a request about a scenario in which the UAV hit a person."""
    record = folder / "found.npz"
    save(hits_a_person(), record)
    found = flown("IV:person:descent:seen", record)
    request = CaseRequest(
        name=f"search {found.signature}",
        signature=found.signature,
        violations=((scenario, found),),
        job=dataclasses.replace(JOB, npcs=policy_spec(policy)),
        map=LAWN,
        budget=budget,
    )
    return CaseFlights(request, fly)


def crossed(folder: Path, *, fails_until_s: float, budget: int = 12) -> CaseFlights:
    """Return flights that hit an entry at its time, and up to a time later."""
    delays_s: list[float] = []

    def fly(job: FlightJob, scenario: Scenario) -> CompletedFlight:
        delays_s.append(scenario["person-1.delay_s"])
        fails = 0 <= delays_s[-1] - delays_s[0] <= fails_until_s
        return flown("IV:person:descent:seen" if fails else "")

    return flights_after(folder, PERSON_ALONE, fly, budget=budget)


def chased(folder: Path, fly: FlyFunction, policy: str = "graded") -> CaseFlights:
    """Return flights about a chasing person."""
    told = with_all_values({"grade": 2.0, "lasts_s": 5.0}, "person-1", "person")
    chasing = dataclasses.replace(PERSON_ALONE, genes=(*PERSON_ALONE.genes, *told.items()))
    return flights_after(folder, repair(chasing, LAWN), fly, policy, budget=20)
