"""From a violation to a case, by the steps of ``plan.py``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from pytest_garl.cases.case import RecordedBehaviour
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.flight.flight_file import load
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_flights import CaseFlights, find_colliding_object
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult, FailingScenario
from pytest_garl.shrinking.move_reduction import shorter_records
from pytest_garl.shrinking.new_case import new_case
from pytest_garl.shrinking.plan import (
    ANOTHER_AS_FOUND,
    AS_FOUND,
    BARE_BY_POLICY,
    BARE_BY_RECORD,
    CONFIRM_FLIGHTS,
    NEIGHBOURS,
    SHORTER_RECORD,
)
from pytest_garl.shrinking.shrink import shrink
from pytest_garl.shrinking.simplification import (
    bare_scenario,
    bare_scenario_around_marker,
    empty_scenario,
    without_other_objects,
)
from pytest_garl.shrinking.weaker_adversary import confirm_crossing, confirm_lower_grade

NOT_REPRODUCED = "its flights with the recorded moves do not fail in the same way"
CANDIDATES = 3
"""Violations of a signature that are tried until the neighbours of one fail as well."""


def build_case(request: CaseRequest, fly: FlyFunction) -> CaseResult:
    """Return the case of a request, or the reason for none."""
    return CaseBuilder(request, fly).build()


class CaseBuilder:
    """Makes a case of one signature's violations, or finds the reason why it cannot."""

    def __init__(self, request: CaseRequest, fly: FlyFunction) -> None:
        self._request = request
        self._flights = CaseFlights(request, fly)

    def build(self) -> CaseResult:
        """Return the case, or the reason for none."""
        request, flights = self._request, self._flights
        scenarios = request.scenarios
        if not scenarios:
            return flights.result(None, NOT_REPRODUCED)
        # Data that the landing system never read is no cause; dropping it takes no flight.
        first = [flights.without_idle(each) for each in scenarios[:CANDIDATES]]
        scenarios = [*first, *scenarios[CANDIDATES:]]
        if request.is_exception:
            return self._exception(scenarios[0])
        if not find_colliding_object(flights.live_flight(scenarios[0])):
            return self._without_collision(scenarios)
        crossing = confirm_crossing(flights, scenarios[0])
        if crossing is not None and (crossing.is_robust or flights.left <= NEIGHBOURS):
            return self._result(crossing)
        best = confirm_lower_grade(flights, scenarios[0]) if crossing is None else None
        best = best or self._confirm_bare(scenarios[0])
        if best is None or (best.neighbours_failed < NEIGHBOURS and flights.left > NEIGHBOURS):
            best = self._most_robust(scenarios[:CANDIDATES], best)
        if crossing is not None and (best is None or best.neighbours_failed < NEIGHBOURS):
            # Both sit on an edge, and the crossing is the simpler one.
            return self._result(crossing)
        if best is None:
            return flights.result(None, NOT_REPRODUCED)
        return self._result(self._shrink(best)[-1])

    def _without_collision(self, scenarios: Sequence[Scenario]) -> CaseResult:
        """Return the case of a failure in which no moving body was hit.

        It is shrunk first, and the neighbours of the simplest scenario are flown in the end.
        """
        flights, first = self._flights, scenarios[0]
        # The simplest scenario may sit on an edge, and a step back has neighbours as well.
        budget = flights.left - 2 * NEIGHBOURS
        found = shrink(first, flights.fails_live, flights.map, budget)
        best = simplest_robust(flights, first, found.history, flights.live_behaviour)
        if best is None or (best.neighbours_failed < NEIGHBOURS and flights.left > NEIGHBOURS):
            best = self._most_robust(scenarios[:CANDIDATES], best)
        if best is None:
            return flights.result(None, NOT_REPRODUCED)
        return self._result(with_shorter_record(flights, best)[-1])

    def _result(self, failing: FailingScenario) -> CaseResult:
        """Return the case of a failure, with the answer whether it could have been prevented."""
        flights = self._flights
        case = new_case(
            self._request,
            flights.as_found(failing),
            flights.prevention(failing),
            flights.untried(failing),
        )
        return flights.result(case)

    def _exception(self, first: Scenario) -> CaseResult:
        """Return the case of an exception or a hang: with an empty scenario if that fails too."""
        request, flights = self._request, self._flights
        found = flights.live_behaviour(first)
        empty = empty_scenario(first, request.map)
        for scenario, behaviour in ((empty, RecordedBehaviour(moves=())), (first, found)):
            flight = flights.fly_recorded(scenario, behaviour)
            if request.fails(scenario, flight):
                failing = FailingScenario(
                    origin=first, scenario=scenario, behaviour=behaviour, flight=flight
                )
                return flights.result(new_case(request, failing))
        return flights.result(None, NOT_REPRODUCED)

    def _confirm_bare(self, first: Scenario) -> FailingScenario | None:
        """Return the collision with the object that was hit alone, if it still fails.

        First the search's policy steers.  Then the object repeats its moves around the same marker:
        in clear weather, and in the weather that was found.
        """
        flights, map = self._flights, self._request.map
        name = find_colliding_object(flights.live_flight(first))
        scenario = bare_scenario(first, map, name)
        if scenario != first and flights.suffice_for(BARE_BY_POLICY):
            failing = self._confirm_live(first, scenario)
            if failing is not None:
                return failing
        behaviour = flights.live_behaviour(first).only(name)
        for scenario in (
            bare_scenario_around_marker(first, map, name),
            without_other_objects(first, map, name),
        ):
            if scenario == first or not flights.suffice_for(BARE_BY_RECORD):
                continue
            failing = flights.confirm(first, scenario, behaviour)
            if failing is not None:
                return failing
        return None

    def _confirm_live(self, origin: Scenario, scenario: Scenario) -> FailingScenario | None:
        """Fly a scenario with the search's policy, then with the moves that its objects made."""
        flights = self._flights
        if not flights.fails_live(scenario):
            return None
        return flights.confirm(origin, scenario, flights.live_behaviour(scenario))

    def _most_robust(
        self, scenarios: Sequence[Scenario], best: FailingScenario | None
    ) -> FailingScenario | None:
        """Return the first violation all of whose neighbours fail, or the best of those tried."""
        flights = self._flights
        for number, scenario in enumerate(scenarios):
            if not flights.suffice_for(ANOTHER_AS_FOUND if number and best else AS_FOUND):
                break
            found = flights.confirm(scenario, scenario, flights.live_behaviour(scenario))
            if found is None:
                continue
            if best is None or found.neighbours_failed > best.neighbours_failed:
                best = found
            if found.neighbours_failed == NEIGHBOURS:
                break
        return best

    def _shrink(self, best: FailingScenario) -> tuple[FailingScenario, ...]:
        """Return the simplest robust failure with all moves, and with a shorter record, if any."""
        flights = self._flights
        # Steps back from an edge, and a shorter record of moves, need flights as well.
        reserve = flights.left // 3 if any(own for _, own in best.behaviour.moves) else 0
        budget = flights.left - CONFIRM_FLIGHTS - reserve
        if budget < 2:
            return with_shorter_record(flights, best)
        name = find_colliding_object(best.flight)
        found = shrink(
            best.scenario, flights.fails_live, flights.map, budget, colliding_object=name
        )
        simplest = simplest_robust(
            flights,
            best.origin,
            found.history[1:],
            flights.live_behaviour,
            at_least=best.neighbours_failed,
        )
        return with_shorter_record(flights, simplest or best)


def simplest_robust(
    flights: CaseFlights,
    origin: Scenario,
    history: Sequence[Scenario],
    behaviour_of: Callable[[Scenario], RecordedBehaviour],
    *,
    at_least: int = 0,
) -> FailingScenario | None:
    """Return the simplest failing scenario all of whose neighbours fail, or the most robust.

    ``history`` are scenarios that failed, from complex to simple.  Each that is tried is flown with
    its recorded moves, as the case will be.  Returns None if not even ``at_least`` neighbours of
    one fail.
    """
    kept: FailingScenario | None = None
    for scenario in _from_last_to_first(history):
        behaviour = behaviour_of(scenario)
        if flights.left < flights.to_confirm(scenario, behaviour):
            break
        found = flights.confirm(origin, scenario, behaviour, at_least=at_least)
        if found is None:
            continue
        kept, at_least = found, found.neighbours_failed + 1
        if found.neighbours_failed == NEIGHBOURS:
            break
    return kept


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
        if not flights.suffice_for(SHORTER_RECORD):
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
