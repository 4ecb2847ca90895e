"""From the scenarios that shrinking found to a robust one, with a short record of moves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from pytest_garl.regressions.case import RecordedBehaviour
from pytest_garl.regressions.case_flights import CaseFlights
from pytest_garl.regressions.case_request import FailingScenario
from pytest_garl.regressions.recorded_behaviour import find_colliding_object
from pytest_garl.regressions.robustness import NEIGHBOURS
from pytest_garl.regressions.shorter_records import shorter_records
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight_file import load


def simplest_robust(
    flights: CaseFlights,
    best: FailingScenario,
    history: Sequence[Scenario],
    behaviour_of: Callable[[Scenario], RecordedBehaviour],
) -> FailingScenario:
    """Return the simplest failing scenario all of whose neighbours fail, or the most robust.

    ``history`` are scenarios that failed, from complex to simple.  Each that is tried is flown once
    with its recorded moves, as the case will be.
    """
    kept: FailingScenario | None = None
    for scenario in _from_last_to_first(history):
        if flights.left < 1 + NEIGHBOURS:
            break
        if kept is not None and kept.neighbours_failed == NEIGHBOURS:
            break
        at_least = best.neighbours_failed if kept is None else kept.neighbours_failed + 1
        behaviour = behaviour_of(scenario)
        found = flights.confirm(best.origin, scenario, behaviour, at_least=at_least)
        kept = found or kept
    return kept or best


def with_shorter_record(
    flights: CaseFlights, failing: FailingScenario
) -> tuple[FailingScenario, ...]:
    """Return the failing scenario, and one with the shortest record that still fails, if any."""
    shorter = _shorten_record(flights, failing)
    return (failing,) if shorter is None else (failing, shorter)


def _shorten_record(flights: CaseFlights, failing: FailingScenario) -> FailingScenario | None:
    moves = failing.behaviour.moves
    if not any(own for _, own in moves) or not failing.flight.record.exists():
        return None
    name, flight = find_colliding_object(failing.flight), load(failing.flight.record)
    for scenario, shorter in shorter_records(failing.scenario, moves, flight, name, flights.map):
        if flights.left < 1 + NEIGHBOURS:
            break
        if (scenario, shorter) == (failing.scenario, moves):
            continue
        behaviour = RecordedBehaviour(moves=shorter, changes=failing.behaviour.changes)
        at_least = failing.neighbours_failed
        found = flights.confirm(failing.origin, scenario, behaviour, at_least=at_least)
        if found is not None:
            return found
    return None


def _from_last_to_first(history: Sequence[Scenario]) -> Iterator[Scenario]:
    """Yield the last scenario, which may sit on an edge, then some before it, and the first.

    Steps double: each scenario takes four flights, and few flights are left.
    """
    index, step = len(history) - 1, 1
    while index > 0:
        yield history[index]
        index, step = index - step, 2 * step
    yield from history[:1]
