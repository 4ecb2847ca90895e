"""Go on shrinking a saved case, with a ledger and a pool of its own."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.adversary.policies import policy_spec
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.pursuit import Finding, Inquiry, Pursuit
from pytest_garl.regressions.replay import system_of
from pytest_garl.scenarios.maps import load_map
from pytest_garl.search.batch import own_pool
from pytest_garl.search.errands import Done, Errands, Fly
from pytest_garl.search.job import Job
from pytest_garl.search.reference import BUILT_IN, reference_to, sources_sha256

TIMEOUT_S = 10.0


def shrink_case(
    case: Case, folder: Path, map_folders: tuple[Path, ...], flights: int, workers: int
) -> Finding:
    """Return a simpler case, or the reason why there is none."""
    map = load_map(case.scenario.map, map_folders)
    system = system_of(case, folder)
    with own_pool(workers) as (ledger, pool):
        job = Job(
            system=reference_to(system),
            system_sha256=sources_sha256(system),
            simulator=BUILT_IN,
            map=map.name,
            map_sha256=map.sha256,
            map_folders=tuple(str(each) for each in map_folders),
            npcs=policy_spec(case.policy),
            limits=case.limits,
            timeout_s=TIMEOUT_S,
            path=(str(folder),),
            flights=str(ledger.path.parent / "flights"),
        )

        def think(fly: Fly) -> Finding:
            done: Done = fly(job, case.scenario)
            inquiry = Inquiry(
                name=case.id,
                signature=case.violation.signature,
                violations=((case.scenario, done),),
                job=job,
                map=map,
                budget=flights - 1,
            )
            return Pursuit(inquiry, fly).run()

        return Errands(ledger, pool, lambda: None).run({case.id: think})[case.id]
