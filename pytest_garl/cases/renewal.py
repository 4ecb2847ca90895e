"""Fly saved cases whose reference is not today's, and renew it where the flight is the same.

``reference_proofs.py`` says what a reference is, and what proves another one.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pytest_garl.cases.case import Case
from pytest_garl.cases.collected_tests import CollectedProject
from pytest_garl.cases.description import violation_in
from pytest_garl.cases.reference_proofs import with_sources
from pytest_garl.cases.replay import SourceHashes, system_of
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.execution.reference import Reference, reference_to
from pytest_garl.execution.severity import Severity
from pytest_garl.execution.severity_of_flight import severity_of
from pytest_garl.execution.sources import data_files, sources_sha256
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.npcs.domain_policy import READ_STORIES
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.verdicts.verdict import Verdict

RenewalResult = Literal["renewed", "renamed", "current", "fixed", "not renewed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Renewal:
    """What became of a case; ``case`` is the one to write, ``reason`` says why there is none."""

    path: Path
    result: RenewalResult
    before: Case
    case: Case | None = None
    reason: str = ""
    written: Path | None = None
    """The file, once it is written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Order:
    """A case to fly, with today's sources."""

    path: Path
    case: Case
    job: FlightJob
    sources: SourceHashes


def renew(
    cases: Mapping[Path, Case],
    collection: CollectedProject,
    simulator: Reference,
    map_folders: tuple[Path, ...],
    workers: int,
    on_flown: Callable[[int, int], None] = lambda flown, of: None,
) -> list[Renewal]:
    """Fly the cases whose reference is not today's, and return what becomes of each case."""
    done: list[Renewal] = []
    orders: list[_Order] = []
    with temporary_pool(workers) as (ledger, pool):
        flights = ledger.path.parent / "flights"
        for path, case in cases.items():
            if case.status == "fixed":
                done.append(Renewal(path=path, result="fixed", before=case))
                continue
            try:
                order = _order(path, case, collection, simulator, map_folders, flights)
            except GarlError as error:
                done.append(_refused(path, case, str(error)))
                continue
            if order.sources == SourceHashes.of(case.evidence):
                done.append(Renewal(path=path, result="current", before=case))
            else:
                orders.append(order)
        requests = OnDemandFlights(ledger, pool, lambda: on_flown(requests.flown, len(orders)))
        done += requests.run({str(order.path): _renewed(order) for order in orders}).values()
    return sorted(done, key=lambda each: each.path)


def _order(
    path: Path,
    case: Case,
    collection: CollectedProject,
    simulator: Reference,
    map_folders: tuple[Path, ...],
    flights: Path,
) -> _Order:
    if case.of_another_engine:
        raise GarlError(
            f"{case.of_another_engine}: renew it with garl_engine = {case.evidence.engine}"
        )
    map = load_map(case.scenario.map, map_folders)
    system = system_of(case, _import_folder(case, collection.root))
    tests = collection.tests_of(case.system)
    finders = [test for test in tests if test.nodeid == case.test] or tests
    files = sorted({file for test in finders for file in test.data_files})
    job = FlightJob.for_system(
        reference_to(system),
        map,
        case.behaviour.policy,
        system_sha256=sources_sha256(system, data_files(files, collection.root)),
        simulator=simulator,
        map_folders=map_folders,
        limits=case.limits,
        flights=flights,
    )
    return _Order(path=path, case=case, job=job, sources=SourceHashes.of_job(job))


def _import_folder(case: Case, root: Path) -> Path:
    """Return the folder from which pytest imports the file of a case's test, by default."""
    test = root / case.test.partition("::")[0]
    if "::" not in case.test or not test.is_file():
        return root
    if str(root) not in sys.path:
        sys.path.insert(0, str(root))
    folder = test.parent
    while (folder / "__init__.py").is_file():
        folder = folder.parent
    return folder


def _renewed(order: _Order) -> Callable[[FlyFunction], Renewal]:
    def fly(fly: FlyFunction) -> Renewal:
        flown = fly(order.job, order.case.scenario)
        return renewal_by(order.path, order.case, order.sources, flown, order.job.load_map())

    return fly


def renewal_by(
    path: Path, case: Case, sources: SourceHashes, flight: CompletedFlight, map: Map
) -> Renewal:
    """Return what becomes of a case that was flown again."""
    result, recorded = flight.result, case.evidence.trajectory_sha256
    if result.inconclusive:
        return _refused(path, case, "its flight is inconclusive: fly it while the machine is idle")
    if not recorded:
        return _refused(path, case, f"it holds no hash of its flight; {_shrink(path)}")
    if flight.sha256 != recorded:
        return _refused(path, case, _difference(path, case, flight))
    renewed = with_sources(case, sources)
    if flight.record.exists():
        # A flight whose process ended early leaves none.
        record = load(flight.record)
        evidence = dataclasses.replace(renewed.evidence, versions=record.versions, cpu=record.cpu)
        renewed = dataclasses.replace(renewed, evidence=evidence)
    else:
        record = None
    if not case.assertion:
        if not result.verdict.violation:
            return _refused(
                path,
                case,
                "its flight is the recorded one to the byte, but today's verdict finds no "
                f"violation in it: delete it, if `garl cases replay {path}` agrees",
            )
        severity = _severity_of(case, record, result.verdict, map)
        violation = violation_in(result.verdict, record, severity, is_shrunk=case.is_shrunk)
        renewed = dataclasses.replace(renewed, violation=violation, severity=severity)
    renamed = renewed.id != case.id or renewed.violation.signature != case.violation.signature
    return Renewal(path=path, result="renamed" if renamed else "renewed", before=case, case=renewed)


def _severity_of(case: Case, flight: Flight | None, verdict: Verdict, map: Map) -> Severity:
    """Return what a case takes in today's words, if that are conditions.

    The policy that moves a body is in its own file, which may be gone.
    """
    if flight is None or case.severity.about != "conditions" or case.policy not in READ_STORIES:
        return case.severity
    found = severity_of(flight, verdict, case.scenario, map, policy_spec(case.policy))
    if found is None or found.about != "conditions":
        return case.severity
    return dataclasses.replace(found, untried=case.severity.untried)


def _difference(path: Path, case: Case, flight: CompletedFlight) -> str:
    signature = case.ending
    if flight.signature == signature:
        return f"it fails in the same way, in another flight than the recorded one; {_shrink(path)}"
    if flight.signature:
        return (
            f"it fails in another way, {flight.signature} instead of {signature}: look at it with "
            f"`garl cases replay {path}`"
        )
    return f"it does not fail any more: `garl cases replay {path}` says whether that is a repair"


def _shrink(path: Path) -> str:
    return f"`garl cases shrink {path}` renews its evidence"


def _refused(path: Path, case: Case, reason: str) -> Renewal:
    return Renewal(path=path, result="not renewed", before=case, reason=reason)
