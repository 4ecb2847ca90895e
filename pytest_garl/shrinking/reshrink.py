"""Shrink a saved case further, with a temporary ledger and pool."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.cases.case import Case
from pytest_garl.cases.replay import system_of
from pytest_garl.cases.user_failure import UserAssertion
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import OnDemandFlights
from pytest_garl.execution.reference import BUILT_IN, Reference, reference_to
from pytest_garl.execution.sources import sources_sha256
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult
from pytest_garl.shrinking.investigation import simplify_case


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
        simplify = functools.partial(simplify_case, request, saved=case, as_it_fails=as_it_fails)
        requests = OnDemandFlights(ledger, pool, lambda: on_flown(requests.flown))
        return requests.run({case.id: simplify})[case.id]
