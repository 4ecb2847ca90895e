"""Read from a flight's record what the objects did, so that they can repeat it without a policy."""

from __future__ import annotations

from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.case import RecordedBehaviour
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight_file import load


def recorded_behaviour(flight: CompletedFlight, scenario: Scenario, map: Map) -> RecordedBehaviour:
    """Return what each object did in a flight; no moves if the flight left no record."""
    names = [name for name, _ in map.without(scenario.removed_objects).present_objects]
    if not flight.record.exists():
        return RecordedBehaviour(moves=tuple((name, ()) for name in names))
    objects = load(flight.record).objects
    made = {item.name: item.moves for item in objects}
    return RecordedBehaviour(
        moves=tuple(
            (name, tuple((float(x), float(y)) for x, y in made.get(name, ()))) for name in names
        ),
        changes=tuple((item.name, item.changes) for item in objects if item.changes),
    )


def find_colliding_object(flight: CompletedFlight) -> str:
    """Return the moving object that the UAV hit; empty if it hit none."""
    hit, kind = flight.result.collisions, flight.result.verdict.violation_type
    return hit[-1] if hit and kind == "IV" else ""
