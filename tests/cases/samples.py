"""Cases and scenarios that several tests share."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pytest_garl.cases.case import Case, CaseEvidence, Violation
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import Reference
from pytest_garl.execution.result import FlightResult
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import snapped
from pytest_garl.scenarios.validity import repair
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.verdicts.verdict import Limits
from tests.support.results import flight_result

LAWN = load_map("lawn")
OBJECT_NAMES = [name for name, _ in LAWN.present_objects]
COLLIDING_OBJECT = OBJECT_NAMES[0]
SYSTEM = "stack.landing:Lander"


def case(
    signature: str = "IV:dog:last-metre:unseen", description: str = "A dog. It bites."
) -> Case:
    """Return a case in which the UAV hits a dog on the lawn."""
    genome = genome_for(LAWN)
    row = genome.random(np.random.default_rng(1))
    scenario = repair(decode(row, genome, map="lawn", seed=9), LAWN).without(*OBJECT_NAMES[:-1])
    return Case(
        system=SYSTEM,
        status="open",
        live=True,
        scenario=scenario,
        violation=Violation(
            signature=signature,
            type="IV",
            property="collision",
            margin=0.0,
            unit="m",
            description=description,
        ),
        policy="dqn",
        policy_sha256="ab" * 32,
        moves=((OBJECT_NAMES[-1], ((0.0, 0.0), (0.0, 0.0), (0.6, -0.8))),),
        evidence=CaseEvidence(
            trajectory_sha256="cd" * 32,
            cpu="x86_64-avx2",
            map_sha256=LAWN.sha256,
            neighbours=3,
            neighbours_failed=3,
            removed="3 of 4 objects",
            versions=(("pytest-garl", "0.1.0"), ("numpy", "2.4.0")),
            system_sha256="ef" * 32,
            simulator_sha256="12" * 32,
        ),
        limits=Limits(),
    )


def case_with_changes() -> Case:
    """Return a case whose policy changed the environment."""
    changes = ((0, "environment.fog", 0.01), (2, "environment.sun_position", -0.01))
    return dataclasses.replace(case(), policy="online-rl", changes=((OBJECT_NAMES[-1], changes),))


def violating_scenario(seed: int = 7) -> Scenario:
    """Return a scenario on the lawn, with all of its objects."""
    genome = genome_for(LAWN)
    row = genome.random(np.random.default_rng(seed))
    return repair(decode(row, genome, map="lawn", seed=1), LAWN)


VIOLATING_SCENARIO = snapped(
    violating_scenario().replace({f"{COLLIDING_OBJECT}.velocity": 0.9, "environment.fog": 0.12}),
    LAWN,
)
SIGNATURE = "IV:dog:last-metre:unseen"
Fails = Callable[[Scenario, str], bool]
JOB = FlightJob.for_system(
    Reference(module="stack.landing", file="", qualname="Lander"),
    LAWN,
    policy_spec("stationary"),
    system_sha256="ab" * 32,
    path=(),
    flights=Path("/nowhere"),
)


def collision_result(signature: str) -> FlightResult:
    """Return the result of a collision with a signature, or of a landing without one."""
    return flight_result(signature, collisions=(COLLIDING_OBJECT,) if signature else ())


def result_of(signature: str) -> FlightResult:
    """Return the result of a flight: a collision only if the signature is one with a body."""
    is_hit = signature.startswith("IV:")
    return collision_result(signature) if is_hit else flight_result(signature)


class FakeFlights:
    """Stands for the simulator: ``fails`` gets scenario and NPC policy; flights are counted."""

    def __init__(self, fails: Fails, signature: str = SIGNATURE) -> None:
        self.fails, self.count, self.signature = fails, 0, signature

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        self.count += 1
        pilot = job.system.qualname == "ReferencePilot"
        failed = not pilot and self.fails(scenario, job.npcs.name)
        return CompletedFlight(
            result=result_of(self.signature if failed else ""),
            sha256="cd" * 32,
            record=Path("/nowhere/x"),
        )


def make_case_request(budget: int, *scenarios: Scenario, signature: str = SIGNATURE) -> CaseRequest:
    """Return a request for a case of violating scenarios."""
    found = CompletedFlight(result=result_of(signature), sha256="", record=Path("/nowhere/x"))
    return CaseRequest(
        name=f"search {signature}",
        signature=signature,
        violations=tuple((each, found) for each in scenarios),
        job=JOB,
        map=LAWN,
        budget=budget,
    )
