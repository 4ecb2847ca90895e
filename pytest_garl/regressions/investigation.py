"""From a violation to a case: confirm it, ask whether it can be avoided, shrink it, record it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence

from pytest_garl.adversary.recorded import recorded_spec
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.execution.reference import reference_to
from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.case import Avoidable, Case, RecordedBehaviour
from pytest_garl.regressions.case_request import CaseRequest, CaseResult, Failure, simplest_first
from pytest_garl.regressions.move_reduction import shorter_records
from pytest_garl.regressions.new_case import (
    case_of,
    find_colliding_object,
    nobody_asked,
    recorded_behaviour,
    unasked,
)
from pytest_garl.regressions.robustness import COUNT, neighbours
from pytest_garl.regressions.shrink import alone, bare, clear, nobody, shrink
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight_file import load
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot

PILOTS = 3
"""Flights of the reference pilot: against the recorded moves, against the live policy, and one more
where the shortest record leaves nobody a way out."""
LEAST = 2 + COUNT + PILOTS
"""Flights without which nothing can be said: one without what the failure should not need, one as
found, three neighbours, the reference pilot."""
EXCEPTION = 2
"""Flights for a Python exception or a hang, which hardly depends on the scenario: bare, and as
found."""
UNLIKE = "its flights with the recorded moves do not fail in the same way"
CANDIDATES = 3
"""So many violations of a signature are tried for one whose neighbours fail as well."""


class CaseBuilder:
    """The train of thought about one signature; every flight goes through ``fly``."""

    def __init__(self, request: CaseRequest, fly: FlyFunction) -> None:
        self._request, self._fly, self._flights, self._piloted = request, fly, 0, 0
        self._flown: dict[Scenario, CompletedFlight] = dict(request.violations)

    def run(self) -> CaseResult:
        """Return what was found out."""
        request = self._request
        simple = simplest_first(request)
        if not simple:
            return self._finding(None, UNLIKE)
        if request.exception:
            return self._exception(simple[0])
        best = self._barest(simple[0])
        if best is None or (best.robust < COUNT and self._left > COUNT):
            best = self._most_robust(simple[:CANDIDATES], best)
        if best is None:
            return self._finding(None, UNLIKE)
        # A case that nobody can avoid gates nothing: rather a longer record that leaves a way out.
        *others, simplest = self._shrunk(best)
        failure, avoidable = simplest, self._avoidable(simplest)
        for longer in others:
            if avoidable == "no" and (found := self._avoidable(longer)) != "no":
                failure, avoidable = longer, found
        return self._finding(case_of(request, failure, avoidable))

    def _exception(self, first: Scenario) -> CaseResult:
        """Return a Python exception or a hang in the barest scenario, or as it was found."""
        found = recorded_behaviour(self._flown[first], first, self._map)
        for scenario, behaviour in (
            (nobody(first, self._map), RecordedBehaviour(moves=())),
            (first, found),
        ):
            done = self._again(scenario, behaviour)
            if self._request.failed(scenario, done):
                failure = unasked(first, scenario, behaviour, done)
                return self._finding(case_of(self._request, failure, nobody_asked(failure)))
        return self._finding(None, UNLIKE)

    @property
    def _map(self) -> Map:
        return self._request.map

    @property
    def _left(self) -> int:
        """Flights that may be spent before the reference pilot's."""
        return self._request.budget - PILOTS - (self._flights - self._piloted)

    def _finding(self, case: Case | None, reason: str = "") -> CaseResult:
        return CaseResult(
            signature=self._request.signature,
            case=case,
            flights=self._flights,
            piloted=self._piloted,
            reason=reason,
        )

    def _go(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        self._flights += 1
        return self._fly(job, scenario)

    def _again(self, scenario: Scenario, behaviour: RecordedBehaviour) -> CompletedFlight:
        """Fly with recorded moves."""
        spec = recorded_spec(dict(behaviour.moves), dict(behaviour.changes))
        return self._go(dataclasses.replace(self._request.job, npcs=spec), scenario)

    def _barest(self, first: Scenario) -> Failure | None:
        """Return the failure with all that it should not need taken away, if it still fails.

        First the policy steers; then what was hit repeats its moves around the same marker, in
        clear weather, and lastly in the weather that there was.
        """
        found = self._flown[first]
        colliding_object = find_colliding_object(found)
        scenario = bare(first, self._map, colliding_object)
        # What is left must do for the scenario as it was found.
        if scenario != first and self._left >= (3 if colliding_object else 2) + COUNT:
            done = self._flown[scenario] = self._go(self._request.job, scenario)
            if self._request.failed(scenario, done):
                behaviour = recorded_behaviour(done, scenario, self._map)
                # Where nothing moves, the record is the flight itself.
                done = self._again(scenario, behaviour) if behaviour.moves else done
                if self._request.failed(scenario, done):
                    return self._asked(first, scenario, behaviour, done)
        if not colliding_object:
            return None
        behaviour = _only(recorded_behaviour(found, first, self._map), colliding_object)
        for scenario in (
            clear(first, self._map, colliding_object),
            alone(first, self._map, colliding_object),
        ):
            if scenario == first or self._left < 2 + COUNT:
                continue
            done = self._again(scenario, behaviour)
            if self._request.failed(scenario, done):
                return self._asked(first, scenario, behaviour, done)
        return None

    def _asked(
        self,
        first: Scenario,
        scenario: Scenario,
        behaviour: RecordedBehaviour,
        done: CompletedFlight,
    ) -> Failure:
        robust = self._robust(scenario, behaviour)
        return Failure(
            first=first, scenario=scenario, behaviour=behaviour, done=done, robust=robust
        )

    def _most_robust(self, scenarios: Sequence[Scenario], best: Failure | None) -> Failure | None:
        """Return the first violation all of whose neighbours fail, or the best of those tried."""
        for number, scenario in enumerate(scenarios):
            needed = 1 + COUNT + (LEAST if number and best is not None else 0)
            if self._left < needed:
                break
            behaviour = recorded_behaviour(self._flown[scenario], scenario, self._request.map)
            done = self._again(scenario, behaviour)
            if not self._request.failed(scenario, done):
                continue
            robust = self._robust(scenario, behaviour)
            if best is None or robust > best.robust:
                best = Failure(
                    first=scenario, scenario=scenario, behaviour=behaviour, done=done, robust=robust
                )
            if robust == COUNT:
                break
        return best

    def _robust(self, scenario: Scenario, behaviour: RecordedBehaviour, least: int = 0) -> int:
        """Return how many neighbours fail too; fewer than ``least`` are not counted to the end."""
        robust = COUNT
        for each in neighbours(scenario, self._request.map):
            robust -= not self._request.failed(each, self._again(each, behaviour))
            if robust < least:
                break
        return robust

    def _avoidable(self, failure: Failure) -> Avoidable:
        """Whether a pilot that knows where everything is comes through, landed or aborted."""
        scenario, job = failure.scenario, self._request.job
        pilot = dataclasses.replace(job, system=reference_to(ReferencePilot))
        recorded = recorded_spec(dict(failure.behaviour.moves), dict(failure.behaviour.changes))
        if not self._comes_through(dataclasses.replace(pilot, npcs=recorded), scenario):
            return "no"
        # Where nothing moves, nothing pursues.
        alone = not failure.behaviour.moves
        return "live" if alone or self._comes_through(pilot, scenario) else "recorded"

    def _comes_through(self, pilot: FlightJob, scenario: Scenario) -> bool:
        self._piloted += 1
        done = self._go(pilot, scenario)
        return not done.signature and not self._request.failed(scenario, done)

    def _shrunk(self, best: Failure) -> tuple[Failure, ...]:
        """Return the simplest failure whose neighbours fail as well: with all moves, with few."""
        request = self._request

        def fails(scenario: Scenario) -> bool:
            done = self._flown[scenario] = self._go(request.job, scenario)
            return request.failed(scenario, done)

        # Steps back from an edge want a share as well, and a shorter record of moves.
        reserve = self._left // 3 if any(own for _, own in best.behaviour.moves) else 0
        budget = self._left - 1 - COUNT - reserve
        if budget < 2:
            return self._with_record(best)
        found = shrink(
            best.scenario,
            fails,
            request.map,
            budget,
            colliding_object=find_colliding_object(best.done),
        )
        return self._with_record(
            self._off_the_edge(best, found.history[1:], self._recorded_behaviour)
        )

    def _recorded_behaviour(self, scenario: Scenario) -> RecordedBehaviour:
        return recorded_behaviour(self._flown[scenario], scenario, self._map)

    def _off_the_edge(
        self,
        best: Failure,
        history: Sequence[Scenario],
        recorded_behaviour: Callable[[Scenario], RecordedBehaviour],
    ) -> Failure:
        """Return the simplest of the failures all of whose neighbours fail, or the most robust.

        Each is flown once with its recorded moves, as the case will be.
        """
        kept: Failure | None = None
        for scenario in _ever_further_back(history):
            if self._left < 1 + COUNT or (kept is not None and kept.robust == COUNT):
                break
            behaviour = recorded_behaviour(scenario)
            done = self._again(scenario, behaviour)
            if not self._request.failed(scenario, done):
                continue
            least = best.robust if kept is None else kept.robust + 1
            robust = self._robust(scenario, behaviour, least)
            if robust >= least:
                kept = dataclasses.replace(
                    best,
                    scenario=scenario,
                    behaviour=behaviour,
                    done=done,
                    robust=robust,
                    asked=COUNT,
                )
        return best if kept is None else kept

    def _with_record(self, failure: Failure) -> tuple[Failure, ...]:
        """Return the failure with all moves, and with few where it survives that."""
        shorter = self._recorded(failure)
        return (failure,) if shorter is failure else (failure, shorter)

    def _recorded(self, failure: Failure) -> Failure:
        """Return the failure with the shortest record of moves that it survives."""
        colliding_object = find_colliding_object(failure.done)
        moves = failure.behaviour.moves
        if not any(own for _, own in moves) or not failure.done.record.exists():
            return failure
        flight = load(failure.done.record)
        for scenario, shorter in shorter_records(
            failure.scenario, moves, flight, colliding_object, self._request.map
        ):
            if self._left < 1 + COUNT:
                break
            if (scenario, shorter) == (failure.scenario, moves):
                continue
            behaviour = dataclasses.replace(failure.behaviour, moves=shorter)
            done = self._again(scenario, behaviour)
            if not self._request.failed(scenario, done):
                continue
            robust = self._robust(scenario, behaviour, failure.robust)
            if robust >= failure.robust:
                return dataclasses.replace(
                    failure,
                    scenario=scenario,
                    behaviour=behaviour,
                    done=done,
                    robust=robust,
                    asked=COUNT,
                )
        return failure


def _ever_further_back(history: Sequence[Scenario]) -> Iterator[Scenario]:
    """Yield the last, where the failure may sit on an edge, then some before it, lastly the first.

    Steps double: three flights each decide whether one sits on an edge, and few are left.
    """
    index, step = len(history) - 1, 1
    while index > 0:
        yield history[index]
        index, step = index - step, 2 * step
    yield from history[:1]


def _only(behaviour: RecordedBehaviour, name: str) -> RecordedBehaviour:
    return RecordedBehaviour(
        moves=tuple(each for each in behaviour.moves if each[0] == name),
        changes=tuple(each for each in behaviour.changes if each[0] == name),
    )
