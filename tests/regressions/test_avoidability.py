from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.regressions.avoidability import (
    avoidability,
    avoidability_without_pilot,
    survives_recorded_moves,
)
from pytest_garl.regressions.case import Avoidable, RecordedBehaviour
from pytest_garl.scenarios.scenario import Scenario
from tests.regressions.samples import (
    JOB,
    OBJECT_NAMES,
    SIGNATURE,
    VIOLATING_SCENARIO,
    collision_result,
    make_case_request,
)

MOVES = RecordedBehaviour(moves=((OBJECT_NAMES[0], ((0.5, 0.0),)),))
NOTHING = RecordedBehaviour(moves=())


class ReferenceFlights:
    """Flies the reference pilot, which collides among objects with the given policies."""

    def __init__(self, *fatal: str) -> None:
        self.fatal, self.policies = fatal, list[str]()

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        assert job.system.qualname == "ReferencePilot"
        self.policies.append(job.npcs.name)
        signature = SIGNATURE if job.npcs.name in self.fatal else ""
        return CompletedFlight(result=collision_result(signature), sha256="", record=Path("none"))


@pytest.mark.parametrize(
    ("fatal", "expected"),
    [((), "live"), (("stationary",), "recorded"), (("recorded", "stationary"), "no")],
)
def test_avoidability_names_the_objects_among_which_the_pilot_succeeds(
    fatal: tuple[str, ...], expected: Avoidable
) -> None:
    case_request = make_case_request(10, VIOLATING_SCENARIO)
    fly = ReferenceFlights(*fatal)
    assert (
        avoidability(case_request.job, VIOLATING_SCENARIO, MOVES, fly, fails=case_request.fails)
        == expected
    )


def test_pilot_flies_once_if_nothing_moves() -> None:
    fly = ReferenceFlights()
    case_request = make_case_request(10, VIOLATING_SCENARIO)
    assert (
        avoidability(case_request.job, VIOLATING_SCENARIO, NOTHING, fly, fails=case_request.fails)
        == "live"
    )
    assert fly.policies == ["recorded"]


def test_pilot_survives_recorded_moves_without_a_violation() -> None:
    assert survives_recorded_moves(JOB, VIOLATING_SCENARIO, MOVES, ReferenceFlights())
    assert not survives_recorded_moves(JOB, VIOLATING_SCENARIO, MOVES, ReferenceFlights("recorded"))


def test_case_without_flights_of_the_pilot_assumes_recorded_moves() -> None:
    assert avoidability_without_pilot(MOVES) == "recorded"
    assert avoidability_without_pilot(NOTHING) == "live"
