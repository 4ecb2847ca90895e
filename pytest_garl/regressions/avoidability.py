"""Avoidability: the reference pilot flies the scenario of a violation.

The reference pilot knows where everything is, and it may abort.  If it violates a property as well,
no landing system can be expected to avoid the violation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.execution.reference import reference_to
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
    """Let the reference pilot fly a scenario; return whether it can avoid the violation.

    "live": even if the policy steers the objects; "recorded": only if they repeat their moves;
    "no": never.  ``fails`` says whether a flight without built-in violation fails a user's test.
    """

    def survives(npcs: PolicySpec) -> bool:
        flight = fly_reference_pilot(job, scenario, npcs, fly)
        return not flight.signature and not fails(scenario, flight)

    if not survives(behaviour.policy):
        return "no"
    # If nothing moves, a live policy cannot pursue the pilot.
    return "live" if not behaviour.moves or survives(job.npcs) else "recorded"


def avoidability_without_pilot(behaviour: RecordedBehaviour) -> Avoidable:
    """Return the avoidability that a case gets if the reference pilot does not fly it."""
    return "recorded" if behaviour.moves else "live"


def survives_recorded_moves(
    job: FlightJob, scenario: Scenario, behaviour: RecordedBehaviour, fly: FlyFunction
) -> bool:
    """Return whether the reference pilot violates nothing while objects repeat their moves."""
    return not fly_reference_pilot(job, scenario, behaviour.policy, fly).signature


def fly_reference_pilot(
    job: FlightJob, scenario: Scenario, npcs: PolicySpec, fly: FlyFunction
) -> CompletedFlight:
    """Fly a job's scenario with the reference pilot in place of the landing system."""
    return fly(dataclasses.replace(job, system=reference_to(ReferencePilot), npcs=npcs), scenario)
