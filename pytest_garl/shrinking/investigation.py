"""The investigation of a violation, or of a saved case, by the steps of ``plan.py``.

First it says how each of the two begins, then what only one of them does, then what both do.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator, Sequence

from pytest_garl.cases.case import Case, Prevention, RecordedBehaviour
from pytest_garl.cases.replay import SourceHashes
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.flight.flight_file import load
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_comparison import is_simpler
from pytest_garl.shrinking.case_flights import CaseFlights, find_colliding_object, without_idle
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult, FailingScenario
from pytest_garl.shrinking.move_reduction import shorter_records
from pytest_garl.shrinking.new_case import new_case, replacing_case
from pytest_garl.shrinking.plan import (
    ANOTHER_AS_FOUND,
    AS_FOUND,
    BARE_BY_POLICY,
    BARE_BY_RECORD,
    CANDIDATES,
    NEIGHBOURS,
    SHORTER_RECORD,
    flights_to_shrink_collision,
    flights_to_shrink_saved_case,
    flights_to_shrink_without_collision,
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
NO_LONGER_REPRODUCED = "it does not fail in the same way any more with its recorded moves"
NOTHING_SIMPLER = "nothing simpler was found"


def build_case(request: CaseRequest, fly: FlyFunction) -> CaseResult:
    """Return the case of a request's violations, or the reason for none."""
    return Investigation(request, fly).of_violations()


def simplify_case(
    request: CaseRequest, fly: FlyFunction, saved: Case, *, as_it_fails: bool = False
) -> CaseResult:
    """Return a case that is simpler in one respect and no worse in any, or the reason for none.

    With ``as_it_fails`` a case that fails in another way than the saved one, because its landing
    system has changed, becomes a case of that.
    """
    return Investigation(request, fly).of_saved_case(saved, as_it_fails=as_it_fails)


class Investigation:
    """The steps of one investigation, within the flights of its request."""

    def __init__(self, request: CaseRequest, fly: FlyFunction) -> None:
        self._flights = CaseFlights(request, fly)

    def of_violations(self) -> CaseResult:
        """Return the case of one signature's violations, or the reason for none."""
        flights, request = self._flights, self._flights.request
        # Data that the landing system never read is no cause; dropping it takes no flight.
        found = [flights.without_idle(each) for each in request.scenarios[:CANDIDATES]]
        if request.is_exception:
            return self._exception(found[0])
        is_hit = bool(find_colliding_object(flights.live_flight(found[0])))
        failing = self._collision(found) if is_hit else self._without_collision(found)
        if failing is None:
            return flights.result(None, NOT_REPRODUCED)
        prevention = flights.prevention(failing)
        case = new_case(request, flights.as_found(failing), prevention, flights.untried(failing))
        return flights.result(case)

    def of_saved_case(self, saved: Case, *, as_it_fails: bool) -> CaseResult:
        """Return a simpler case than a saved one, or the reason for none."""
        flights = self._flights
        failing = self._reproduce(saved, as_it_fails=as_it_fails)
        if failing is None:
            return flights.result(None, NO_LONGER_REPRODUCED)
        if flights.request.signature != saved.ending:
            return flights.result(self._replacing(saved, failing, flights.prevention(failing)))
        better = self._simpler_case(saved, failing)
        if better is None and self._is_outdated(saved):
            better = self._replacing(saved, failing, saved.prevention)
        return flights.result(better, "" if better else NOTHING_SIMPLER)

    # What only an investigation of violations does

    def _exception(self, first: Scenario) -> CaseResult:
        """Return the case of an exception or a hang: with an empty scenario if that fails too."""
        flights, request = self._flights, self._flights.request
        found = flights.live_behaviour(first)
        empty = empty_scenario(first, flights.map)
        for scenario, behaviour in ((empty, RecordedBehaviour(moves=())), (first, found)):
            flight = flights.fly_recorded(scenario, behaviour)
            if request.fails(scenario, flight):
                failing = FailingScenario(
                    origin=first, scenario=scenario, behaviour=behaviour, flight=flight
                )
                return flights.result(new_case(request, failing))
        return flights.result(None, NOT_REPRODUCED)

    def _collision(self, found: Sequence[Scenario]) -> FailingScenario | None:
        """Return the simplest robust failure in which the moving body is hit, if there is one.

        The weakest adversaries are tried before the scenarios as found.
        """
        flights, first = self._flights, found[0]
        crossing = confirm_crossing(flights, first)
        if crossing is not None and crossing.is_robust:
            return crossing
        best = confirm_lower_grade(flights, first) if crossing is None else None
        best = self._most_robust(found, best or self._confirm_bare(first))
        if crossing is not None and (best is None or not best.is_robust):
            # Both sit on an edge, and the crossing is the simpler one.
            return crossing
        if best is None:
            return None
        has_moves = any(own for _, own in best.behaviour.moves)
        budget = flights_to_shrink_collision(flights.left, has_moves=has_moves)
        simplest = self._shrink(best, budget)
        return self.shorter_record(simplest) or simplest

    def _without_collision(self, found: Sequence[Scenario]) -> FailingScenario | None:
        """Return the simplest robust failure in which no moving body was hit, if there is one.

        It is shrunk first, and the neighbours of the simplest scenario are flown in the end.
        """
        flights, first = self._flights, found[0]
        budget = flights_to_shrink_without_collision(flights.left)
        history = shrink(first, flights.fails_live, flights.map, budget).history
        best = self.simplest_robust(first, history, flights.live_behaviour)
        best = self._most_robust(found, best)
        return best and (self.shorter_record(best) or best)

    def _confirm_bare(self, first: Scenario) -> FailingScenario | None:
        """Return the collision with the object that was hit alone, if it still fails.

        First the search's policy steers.  Then the object repeats its moves around the same marker:
        in clear weather, and in the weather that was found.
        """
        flights, map = self._flights, self._flights.map
        name = find_colliding_object(flights.live_flight(first))
        scenario = bare_scenario(first, map, name)
        if (
            scenario != first
            and flights.suffice_for(BARE_BY_POLICY)
            and flights.fails_live(scenario)
        ):
            failing = flights.confirm(first, scenario, flights.live_behaviour(scenario))
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

    def _most_robust(
        self, found: Sequence[Scenario], best: FailingScenario | None
    ) -> FailingScenario | None:
        """Return the first failure all of whose neighbours fail, or the best of those tried.

        ``best`` comes before the scenarios as found.
        """
        flights = self._flights
        for number, scenario in enumerate(found):
            step = ANOTHER_AS_FOUND if number and best else AS_FOUND
            if (best is not None and best.is_robust) or not flights.suffice_for(step):
                break
            failing = flights.confirm(scenario, scenario, flights.live_behaviour(scenario))
            if failing is not None and (
                best is None or failing.neighbours_failed > best.neighbours_failed
            ):
                best = failing
        return best

    # What only an investigation of a saved case does

    def _reproduce(self, saved: Case, *, as_it_fails: bool) -> FailingScenario | None:
        """Fly the case once more with its record; return None if it does not fail.

        If it may be a case of how it fails today, the request becomes one for that.
        """
        flights, evidence = self._flights, saved.evidence
        flight = flights.fly_recorded(saved.scenario, saved.behaviour)
        anew = self._is_outdated(saved) and evidence.neighbours > 0
        if not flights.request.fails(saved.scenario, flight):
            if not as_it_fails or not flight.signature:
                return None
            flights.request = dataclasses.replace(flights.request, signature=flight.signature)
            anew = True
        if anew and flights.left >= NEIGHBOURS:
            # The neighbours in the file were flown with other sources.
            return flights.count_neighbours(saved.scenario, saved.scenario, saved.behaviour, flight)
        return FailingScenario(
            origin=saved.scenario,
            scenario=saved.scenario,
            behaviour=saved.behaviour,
            flight=flight,
            neighbours_failed=evidence.neighbours_failed,
            neighbours_flown=evidence.neighbours,
            window_s=saved.severity.window_s,
        )

    def _is_outdated(self, saved: Case) -> bool:
        """Return whether the case's evidence comes from other sources than today's."""
        today = SourceHashes.of_job(self._flights.request.job)
        return today != SourceHashes.of(saved.evidence)

    def _simpler_case(self, saved: Case, failing: FailingScenario) -> Case | None:
        """Return a simpler case, if one is found; ``failing`` is the saved one's failure.

        Objects repeat their moves and, if that gives nothing, follow the search's policy.
        """
        if saved.severity.window_s is not None:
            # A crossing is alone, careless and as slow as usual; its entry would lose its window.
            return None
        flights, moves = self._flights, failing.behaviour.moves
        scenario = without_idle(flights.request, failing.scenario, failing.flight)
        first = dataclasses.replace(failing, scenario=scenario)
        budget = flights_to_shrink_saved_case(flights.left, is_last=not moves)
        simpler = self._shrink(first, budget, record=first.behaviour)
        better = self._improved(saved, failing, simpler)
        if better is None:
            budget = flights_to_shrink_saved_case(flights.left, is_last=True) if moves else 0
            better = self._improved(saved, failing, self._shrink(first, budget))
        return better

    def _improved(
        self, saved: Case, failing: FailingScenario, simpler: FailingScenario
    ) -> Case | None:
        """Return the case of a simpler failure, if possible with a shorter record.

        Returns None if it is worse than the saved case in any respect, or better in none.
        """
        flights, outdated = self._flights, self._is_outdated(saved)
        improves = functools.partial(is_simpler, saved=saved, map=flights.map, outdated=outdated)
        for each in (self.shorter_record(simpler), simpler):
            if each is None or each == failing:
                continue
            # Escapes are looked for only if the case is simpler in the other respects, and once.
            case = self._replacing(saved, each, saved.prevention)
            if improves(case) and not flights.asked_prevention:
                case = self._replacing(saved, each, flights.prevention(each))
                if improves(case):
                    return case
        return None

    def _replacing(self, saved: Case, failing: FailingScenario, prevention: Prevention) -> Case:
        flights = self._flights
        return replacing_case(saved, flights.request, failing, prevention, flights.untried(failing))

    # What both do

    def _shrink(
        self, failing: FailingScenario, budget: int, *, record: RecordedBehaviour | None = None
    ) -> FailingScenario:
        """Return the simplest robust failure that shrinking finds, or the given one.

        Objects repeat a record; without one they follow the search's policy.
        """
        flights = self._flights

        def behaviour_of(scenario: Scenario) -> RecordedBehaviour:
            if record is None:
                return flights.live_behaviour(scenario)
            return record.without(scenario.removed_objects)

        def fails(scenario: Scenario) -> bool:
            if record is None:
                return flights.fails_live(scenario)
            return flights.fails_recorded(scenario, behaviour_of(scenario))

        hit = find_colliding_object(failing.flight)
        found = shrink(failing.scenario, fails, flights.map, budget, colliding_object=hit)
        simplest = self.simplest_robust(
            failing.origin, found.history[1:], behaviour_of, at_least=failing.neighbours_failed
        )
        return simplest or failing

    def simplest_robust(
        self,
        origin: Scenario,
        history: Sequence[Scenario],
        behaviour_of: Callable[[Scenario], RecordedBehaviour],
        *,
        at_least: int = 0,
    ) -> FailingScenario | None:
        """Return the simplest failing scenario all of whose neighbours fail, or the most robust.

        ``history`` are scenarios that failed, from complex to simple.  Each that is tried is flown
        with its recorded moves, as the case will be.  Returns None if not even ``at_least``
        neighbours of one fail.
        """
        flights = self._flights
        kept: FailingScenario | None = None
        for scenario in _from_last_to_first(history):
            behaviour = behaviour_of(scenario)
            if flights.left < flights.to_confirm(scenario, behaviour):
                break
            found = flights.confirm(origin, scenario, behaviour, at_least=at_least)
            if found is None:
                continue
            kept, at_least = found, found.neighbours_failed + 1
            if found.is_robust:
                break
        return kept

    def shorter_record(self, failing: FailingScenario) -> FailingScenario | None:
        """Return the failure with the shortest record with which it is as robust, if any."""
        flights, moves = self._flights, failing.behaviour.moves
        if not any(own for _, own in moves) or not failing.flight.record.exists():
            return None
        hit, flight = find_colliding_object(failing.flight), load(failing.flight.record)
        for scenario, shorter in shorter_records(failing.scenario, moves, flight, hit, flights.map):
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
