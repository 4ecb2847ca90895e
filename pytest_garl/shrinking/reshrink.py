"""Shrink a saved case further, with a temporary ledger and pool, and keep the simpler case.

A case that fails in another way than the saved one, because its landing system has changed, can be
made a case of that.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.cases.case import NOT_ASKED, Case, Prevention, RecordedBehaviour
from pytest_garl.cases.case_file import record_lines, size_of
from pytest_garl.cases.replay import SourceHashes, system_of
from pytest_garl.cases.user_failure import UserAssertion
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.execution.reference import (
    BUILT_IN,
    Reference,
    reference_to,
    simulator_sha256,
)
from pytest_garl.execution.sources import sources_sha256
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_flights import (
    CaseFlights,
    find_colliding_object,
    without_idle,
)
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult, FailingScenario
from pytest_garl.shrinking.investigation import simplest_robust, with_shorter_record
from pytest_garl.shrinking.new_case import new_case
from pytest_garl.shrinking.plan import CONFIRM_FLIGHTS, NEIGHBOURS
from pytest_garl.shrinking.removed import all_removed
from pytest_garl.shrinking.shrink import shrink
from pytest_garl.shrinking.simplification import complexity, genome_of_scenario

NOT_REPRODUCED = "it does not fail in the same way any more with its recorded moves"
NOTHING_SIMPLER = "nothing simpler was found"


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseSetup:
    """The simulator, data files and assertion with which the tests of a case fly and judge it.

    ``files`` are the data files of the landing system, with the names under which they are hashed.
    """

    user_assertion: UserAssertion | None = None
    simulator: Reference = BUILT_IN
    files: tuple[tuple[str, Path], ...] = ()


def shrink_case(
    case: Case,
    folder: Path,
    map_folders: tuple[Path, ...],
    flights: int,
    workers: int,
    setup: CaseSetup | None = None,
    *,
    as_it_fails: bool = False,
    on_flown: Callable[[int], None] = lambda flown: None,
) -> CaseResult:
    """Return a case that is simpler in one respect and no worse in any, or the reason for none.

    Flies at most ``flights`` flights.  With ``as_it_fails`` a case that fails in another way than
    the saved one becomes a case of that, as complex as it is.
    """
    setup = setup or CaseSetup()
    map = load_map(case.scenario.map, map_folders)
    system = system_of(case, folder)
    with temporary_pool(workers) as (ledger, pool):
        job = FlightJob.for_system(
            reference_to(system),
            map,
            policy_spec(case.policy),
            system_sha256=sources_sha256(system, dict(setup.files)),
            simulator=setup.simulator,
            map_folders=map_folders,
            limits=case.limits,
            flights=ledger.path.parent / "flights",
        )
        request = CaseRequest(
            name=case.id,
            signature=case.ending,
            violations=(),
            job=job,
            map=map,
            budget=flights,
            user_assertion=setup.user_assertion,
            test=case.test,
        )

        def shrink_further(fly: FlyFunction) -> CaseResult:
            return CaseReshrinker(request, fly, case, as_it_fails=as_it_fails).build()

        requests = OnDemandFlights(ledger, pool, lambda: on_flown(requests.flown))
        return requests.run({case.id: shrink_further})[case.id]


class CaseReshrinker:
    """Makes a simpler case from a saved one, or finds the reason why it cannot."""

    def __init__(
        self, request: CaseRequest, fly: FlyFunction, case: Case, *, as_it_fails: bool = False
    ) -> None:
        self._case, self._as_it_fails = case, as_it_fails
        self._flights = CaseFlights(request, fly)

    def build(self) -> CaseResult:
        """Return the simpler case, or the reason for none."""
        case, flights = self._case, self._flights
        saved = self._reproduce()
        if saved is None:
            return flights.result(None, NOT_REPRODUCED)
        if flights.request.signature != case.ending:
            return flights.result(self._replacement(saved, flights.prevention(saved)))
        simpler = self._without_idle(saved)
        # A crossing is alone, careless and as slow as usual; its entry would lose its window.
        is_crossing = case.severity.window_s is not None
        better = None
        if not is_crossing:
            better = self._improved_case(saved, self._shrink_by_record(simpler))
        if better is None and not is_crossing:
            better = self._improved_case(saved, self._shrink_by_policy(simpler))
        if better is None and self._is_outdated():
            better = self._replacement(saved, case.prevention)
        return flights.result(better, "" if better else NOTHING_SIMPLER)

    def _reproduce(self) -> FailingScenario | None:
        """Fly the case once more with its record; return None if it does not fail.

        If it may be a case of how it fails today, the request becomes one for that.
        """
        case, flights = self._case, self._flights
        flight = flights.fly_recorded(case.scenario, case.behaviour)
        anew = self._is_outdated() and case.evidence.neighbours > 0
        if not flights.request.fails(case.scenario, flight):
            if not self._as_it_fails or not flight.signature:
                return None
            flights.request = dataclasses.replace(flights.request, signature=flight.signature)
            anew = True
        evidence = case.evidence
        if anew and flights.left >= NEIGHBOURS:
            # The neighbours in the file were flown with other sources.
            return flights.count_neighbours(case.scenario, case.scenario, case.behaviour, flight)
        return FailingScenario(
            origin=case.scenario,
            scenario=case.scenario,
            behaviour=case.behaviour,
            flight=flight,
            neighbours_failed=evidence.neighbours_failed,
            neighbours_flown=evidence.neighbours,
            window_s=case.severity.window_s,
        )

    def _without_idle(self, saved: FailingScenario) -> FailingScenario:
        """Return the failure without the conditions that cannot have acted: the same flight."""
        found = without_idle(self._flights.request, saved.scenario, saved.flight)
        return dataclasses.replace(saved, scenario=found) if found != saved.scenario else saved

    def _is_outdated(self) -> bool:
        """Return whether the case's evidence comes from other sources than today's."""
        job = self._flights.request.job
        today = SourceHashes(
            system_sha256=job.system_sha256,
            simulator_sha256=simulator_sha256(job.simulator),
            map_sha256=job.map_sha256,
        )
        return today != SourceHashes.of(self._case.evidence)

    def _shrink_by_record(self, saved: FailingScenario) -> FailingScenario:
        """Return the simplest failure in which the remaining objects repeat their moves."""

        def behaviour_of(scenario: Scenario) -> RecordedBehaviour:
            return saved.behaviour.without(scenario.removed_objects)

        def fails(scenario: Scenario) -> bool:
            return self._flights.fails_recorded(scenario, behaviour_of(scenario))

        # If recorded moves give nothing simpler, shrinking by the policy needs flights too.
        divisor = 2 if saved.behaviour.moves else 1
        return self._shrink(saved, fails, behaviour_of, divisor)

    def _shrink_by_policy(self, saved: FailingScenario) -> FailingScenario:
        """Return the simplest failure in which the search's policy steers the objects."""
        if not saved.behaviour.moves:
            return saved
        return self._shrink(saved, self._flights.fails_live, self._flights.live_behaviour, 1)

    def _shrink(
        self,
        saved: FailingScenario,
        fails: Callable[[Scenario], bool],
        behaviour_of: Callable[[Scenario], RecordedBehaviour],
        divisor: int,
    ) -> FailingScenario:
        """Shrink with the flights that are left, divided by ``divisor``."""
        flights = self._flights
        # The last flights are for a result's neighbours and, if there are many, a shorter record.
        reserve = CONFIRM_FLIGHTS if flights.left < 4 * CONFIRM_FLIGHTS else 2 * CONFIRM_FLIGHTS
        budget = (flights.left - reserve) // divisor
        if budget < 1:
            return saved
        colliding_object = find_colliding_object(saved.flight)
        found = shrink(
            saved.scenario, fails, flights.map, budget, colliding_object=colliding_object
        )
        simplest = simplest_robust(
            flights,
            saved.origin,
            found.history[1:],
            behaviour_of,
            at_least=saved.neighbours_failed,
        )
        return simplest or saved

    def _improved_case(self, saved: FailingScenario, simpler: FailingScenario) -> Case | None:
        """Return the case of a failure, if possible with a shorter record, if it is simpler."""
        flights = self._flights
        candidates = reversed(with_shorter_record(flights, simpler))
        for failing in (each for each in candidates if each is not saved):
            case = self._replacement(failing, self._case.prevention)
            # Escapes are looked for only if the case is simpler in the other respects, and once.
            if self._improves(case) and not flights.asked_prevention:
                case = self._replacement(failing, flights.prevention(failing))
                if self._improves(case):
                    return case
        return None

    def _improves(self, case: Case) -> bool:
        return is_simpler(case, self._case, self._flights.map, outdated=self._is_outdated())

    def _replacement(self, failing: FailingScenario, prevention: Prevention) -> Case:
        """Return a failure as the case that replaces the saved one."""
        case, untried = self._case, self._flights.untried(failing)
        if case.is_shrunk:
            # Steps that were tried when it was saved need not be tried again.
            untried = tuple(name for name in untried if name in case.severity.untried)
        found = new_case(self._flights.request, failing, prevention, untried)
        removed = all_removed(case.evidence.removed, found.evidence.removed)
        return dataclasses.replace(
            found,
            status=case.status,
            live=case.live if prevention == NOT_ASKED else found.live,
            accepted=case.accepted,
            worst=case.worst,
            policy=case.policy,
            policy_sha256=case.policy_sha256,
            evidence=dataclasses.replace(found.evidence, removed=removed),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Simplicity:
    """The respects in which two cases of one failure are compared; less of each is better.

    The strongest grade of an object; objects; genes off nominal and their distance from it;
    decisions at which an object moves, and runs of equal moves; characters of the record in the
    file; neighbours that do not fail or were not flown; how much less the case asks of a repair;
    whether the evidence comes from other sources than today's.
    """

    grade: int
    objects: int
    genes: int
    distance: float
    moving: int
    runs: int
    characters: int
    doubtful_neighbours: int
    excused: int
    outdated: bool


def simplicity(case: Case, map: Map, *, outdated: bool = False) -> Simplicity:
    """Return how simple a case is."""
    found = complexity(case.scenario, genome_of_scenario(case.scenario, map))
    evidence = case.evidence
    return Simplicity(
        grade=found.grade,
        objects=found.objects,
        genes=found.genes,
        distance=found.distance,
        moving=sum(move != (0.0, 0.0) for _, own in case.moves for move in own),
        runs=sum(len(list(itertools.groupby(own))) for _, own in case.moves),
        characters=sum(len(line) for line in record_lines(case)),
        doubtful_neighbours=max(NEIGHBOURS, evidence.neighbours) - evidence.neighbours_failed,
        excused=_excused(case),
        outdated=outdated,
    )


def _excused(case: Case) -> int:
    """Return how much less a case asks of a repair: of recorded moves only, or nothing."""
    if case.prevention.answer in ("sensor-limited", "unpreventable"):
        return 2
    return 0 if case.live else 1


def no_worse(one: Simplicity, other: Simplicity) -> bool:
    """Return whether ``one`` is at least as simple as ``other`` in every respect."""
    names = [field.name for field in dataclasses.fields(Simplicity)]
    return all(getattr(one, name) <= getattr(other, name) for name in names)


def is_simpler(case: Case, saved: Case, map: Map, *, outdated: bool) -> bool:
    """Return whether a case is no worse than the saved one and better in one respect.

    ``outdated`` says that the saved case's evidence comes from other sources than today's.
    """
    one, other = simplicity(case, map), simplicity(saved, map, outdated=outdated)
    if one == other:
        return size_of(case, map) < size_of(saved, map)
    return no_worse(one, other)
