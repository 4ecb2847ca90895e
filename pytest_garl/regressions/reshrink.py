"""Go on shrinking a saved case from its own record, with a ledger and a pool of its own."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.execution.batch import temporary_pool
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.execution.reference import (
    BUILT_IN,
    Reference,
    reference_to,
    simulator_sha256,
)
from pytest_garl.execution.sources import sources_sha256
from pytest_garl.regressions.case import Avoidable, Case, RecordedBehaviour
from pytest_garl.regressions.case_file import size_of
from pytest_garl.regressions.case_request import CaseRequest, CaseResult, Failure
from pytest_garl.regressions.investigation import PILOTS, CaseBuilder
from pytest_garl.regressions.new_case import case_of, find_colliding_object
from pytest_garl.regressions.replay import system_of
from pytest_garl.regressions.robustness import COUNT
from pytest_garl.regressions.shrink import shrink
from pytest_garl.regressions.simplicity import no_worse, simplicity
from pytest_garl.regressions.staleness import Sources
from pytest_garl.regressions.user_failure import UserAssertion
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario

LEAST = 1 + 1 + 1 + COUNT + PILOTS
"""Flights without which nothing can be found: the case as it is, a simpler one, that one as it is
recorded, its neighbours, the reference pilot."""
GONE = "it does not fail in the same way any more with its recorded moves"
KEPT = "nothing simpler was found"
_REMOVED = re.compile(r"(\d+) of (\d+) objects, (\d+) of (\d+) genes off nominal")


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """With what the tests of a case fly and judge: their simulator, data files, own assertion.

    ``files`` are what the landing system reads, by the names that their hashes have.
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
    means: Means | None = None,
) -> CaseResult:
    """Return a case that is no worse in any respect and better in one, or the reason for none.

    At most ``flights`` are flown.
    """
    means = means or Means()
    map = load_map(case.scenario.map, map_folders)
    system = system_of(case, folder)
    with temporary_pool(workers) as (ledger, pool):
        job = FlightJob.for_system(
            reference_to(system),
            map,
            policy_spec(case.policy),
            system_sha256=sources_sha256(system, dict(means.files)),
            simulator=means.simulator,
            map_folders=map_folders,
            limits=case.limits,
            flights=ledger.path.parent / "flights",
        )
        request = CaseRequest(
            name=case.id,
            signature=case.violation.signature,
            violations=(),
            job=job,
            map=map,
            budget=flights,
            user_assertion=means.user_assertion,
            test=case.test,
        )

        def think(fly: FlyFunction) -> CaseResult:
            return CaseReshrinker(request, fly, case).run()

        return OnDemandFlights(ledger, pool, lambda: None).run({case.id: think})[case.id]


class CaseReshrinker(CaseBuilder):
    """The train of thought about a saved case: it begins with what its file says."""

    def __init__(self, request: CaseRequest, fly: FlyFunction, case: Case) -> None:
        super().__init__(request, fly)
        self._case = case

    def run(self) -> CaseResult:
        """Return what was found."""
        case = self._case
        first = self._as_saved()
        if first is None:
            return self._finding(None, GONE)
        better = self._better(first, self._by_record(first))
        if better is None:
            better = self._better(first, self._by_policy(first))
        if better is None and self._outdated():
            better = self._saved_as(first, case.avoidable)
        return self._finding(better, "" if better else KEPT)

    def _as_saved(self) -> Failure | None:
        """Return the case's own failure, flown once more with its record."""
        case = self._case
        behaviour = RecordedBehaviour(moves=case.moves, changes=case.changes)
        done = self._again(case.scenario, behaviour)
        if not self._request.failed(case.scenario, done):
            return None
        robust, asked = case.evidence.neighbours_failed, case.evidence.neighbours
        if self._outdated() and asked and self._left >= COUNT:
            # Counted in another world.
            robust, asked = self._robust(case.scenario, behaviour), COUNT
        return Failure(
            first=case.scenario,
            scenario=case.scenario,
            behaviour=behaviour,
            done=done,
            robust=robust,
            asked=asked,
        )

    def _outdated(self) -> bool:
        """Whether the sources are not those that the case's evidence is of."""
        evidence, job = self._case.evidence, self._request.job
        today = Sources(
            system_sha256=job.system_sha256,
            simulator_sha256=simulator_sha256(job.simulator),
            map_sha256=job.map_sha256,
        )
        return today != Sources(
            system_sha256=evidence.system_sha256,
            simulator_sha256=evidence.simulator_sha256,
            map_sha256=evidence.map_sha256,
        )

    def _by_record(self, first: Failure) -> Failure:
        """Return the simplest failure in which the objects that are left repeat their record."""

        def recorded_behaviour(scenario: Scenario) -> RecordedBehaviour:
            return _without(first.behaviour, scenario.removed_objects)

        def fails(scenario: Scenario) -> bool:
            return self._request.failed(
                scenario, self._again(scenario, recorded_behaviour(scenario))
            )

        # What the record does not give may need a policy.
        share = 2 if first.behaviour.moves else 1
        return self._shrunk_by(first, fails, recorded_behaviour, share)

    def _by_policy(self, first: Failure) -> Failure:
        """Return the simplest failure in which a live policy steers: for what no record does."""

        def fails(scenario: Scenario) -> bool:
            done = self._flown[scenario] = self._go(self._request.job, scenario)
            return self._request.failed(scenario, done)

        if not first.behaviour.moves:
            return first
        return self._shrunk_by(first, fails, self._recorded_behaviour, 1)

    def _shrunk_by(
        self,
        first: Failure,
        fails: Callable[[Scenario], bool],
        recorded_behaviour: Callable[[Scenario], RecordedBehaviour],
        share: int,
    ) -> Failure:
        """Shrink with a share of the flights that are left; the last go to neighbours."""
        # The last are for a result's neighbours and, if there are many, for a shorter record.
        reserve = 1 + COUNT if self._left < 4 * (1 + COUNT) else 2 * (1 + COUNT)
        budget = (self._left - reserve) // share
        if budget < 1:
            return first
        colliding_object = find_colliding_object(first.done)
        found = shrink(first.scenario, fails, self._map, budget, colliding_object=colliding_object)
        return self._off_the_edge(first, found.history[1:], recorded_behaviour)

    def _better(self, first: Failure, simpler: Failure) -> Case | None:
        """Return a failure as a case if it is no worse than the saved one, and better in one."""
        candidates = [each for each in reversed(self._with_record(simpler)) if each is not first]
        for failure in candidates:
            case = self._saved_as(failure, self._case.avoidable)
            # Only for what is better otherwise is the reference pilot asked.
            if self._improves(case) and self._piloted + 2 <= PILOTS:
                case = self._saved_as(failure, self._avoidable(failure))
                if self._improves(case):
                    return case
        return None

    def _improves(self, case: Case) -> bool:
        one = simplicity(case, self._map)
        other = simplicity(self._case, self._map, outdated=self._outdated())
        if one == other:
            return size_of(case) < size_of(self._case)
        return no_worse(one, other)

    def _saved_as(self, failure: Failure, avoidable: Avoidable) -> Case:
        """Return a failure as the case that takes the saved one's place."""
        case, found = self._case, case_of(self._request, failure, avoidable)
        removed = _all_removed(case.evidence.removed, found.evidence.removed)
        return dataclasses.replace(
            found,
            status=case.status,
            accepted=case.accepted,
            policy=case.policy,
            policy_sha256=case.policy_sha256,
            evidence=dataclasses.replace(found.evidence, removed=removed),
        )


def _without(behaviour: RecordedBehaviour, removed: tuple[str, ...]) -> RecordedBehaviour:
    """Return the behaviour of the objects that are not removed."""
    return RecordedBehaviour(
        moves=tuple(each for each in behaviour.moves if each[0] not in removed),
        changes=tuple(each for each in behaviour.changes if each[0] not in removed),
    )


def _all_removed(before: str, after: str) -> str:
    """Say what shrinking took away, this time and the times before."""
    first, second = _REMOVED.fullmatch(before), _REMOVED.fullmatch(after)
    if first is None or second is None:
        return before if second is None else after
    objects, all_objects, genes, all_genes = (int(text) for text in first.groups())
    return (
        f"{objects + int(second[1])} of {all_objects} objects, "
        f"{genes + int(second[3])} of {all_genes} genes off nominal"
    )
