"""Changes that policies make to the environment during a flight."""

from __future__ import annotations

from collections.abc import Iterable

from pytest_garl.flight.flight import Flight
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, GeneChange


def changed(scenario: Scenario, changes: Iterable[GeneChange]) -> Scenario:
    """Return the scenario after the changes in order, each clipped to 0 to 1."""
    for key, by in changes:
        scenario = scenario.replace({key: min(1.0, max(0.0, scenario[key] + by))})
    return scenario


def environment_at(scenario: Scenario, flight: Flight, time_s: float) -> Scenario:
    """Return the scenario with all changes up to a time of its flight."""
    made = [
        (decision, (key, by))
        for item in flight.objects
        for decision, key, by in item.changes
        if decision * DECISION_STEP_S <= time_s
    ]
    # Within one decision the objects' order stays, as when it was flown.
    made.sort(key=lambda each: each[0])
    return changed(scenario, (change for _, change in made))
