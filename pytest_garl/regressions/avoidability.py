"""Avoidability: the reference pilot flies the scenario of a violation.

The reference pilot knows where everything is, and it may abort.  If it violates a property as well,
no landing system can be asked to avoid the violation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.execution.reference import reference_to
from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.case import Avoidable, RecordedBehaviour
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot


def avoidability(
    job: FlightJob,
    scenario: Scenario,
    behaviour: RecordedBehaviour,
    fly: FlyFunction,
    *,
    fails: Callable[[Scenario, CompletedFlight], bool],
) -> Avoidable:
    """Return among which objects the reference pilot violates nothing.

    ``fails`` says whether a flight without built-in violation fails a test of the user.
    """

    def survives(npcs: PolicySpec) -> bool:
        flight = fly_reference_pilot(job, scenario, npcs, fly)
        return not flight.signature and not fails(scenario, flight)

    if not survives(behaviour.policy):
        return "no"
    # If nothing moves, a live policy cannot pursue the pilot.
    return "live" if not behaviour.moves or survives(job.npcs) else "recorded"


def assumed_avoidability(behaviour: RecordedBehaviour) -> Avoidable:
    """Return what a case says that the reference pilot has not flown."""
    return "recorded" if behaviour.moves else "live"


def survives_recorded_moves(
    job: FlightJob, scenario: Scenario, behaviour: RecordedBehaviour, fly: FlyFunction
) -> bool:
    """Return whether the reference pilot violates nothing among objects that repeat their moves."""
    return not fly_reference_pilot(job, scenario, behaviour.policy, fly).signature


def fly_reference_pilot(
    job: FlightJob, scenario: Scenario, npcs: PolicySpec, fly: FlyFunction
) -> CompletedFlight:
    """Fly a job's scenario with the reference pilot in place of the landing system."""
    return fly(dataclasses.replace(job, system=reference_to(ReferencePilot), npcs=npcs), scenario)
