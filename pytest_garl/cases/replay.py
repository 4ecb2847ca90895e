"""Fly a saved case again, and decide whether it is fixed: a pass alone may be stale."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from pytest_garl import cpu_dispatch
from pytest_garl.cases.case import Case, CaseEvidence
from pytest_garl.cases.case_test_run import CaseTestResult, run_case_tests
from pytest_garl.engine import engine_of
from pytest_garl.errors import GarlError, LandingSystemError
from pytest_garl.execution.exit_guard import refusing_end
from pytest_garl.execution.fly_and_judge import time_limit_s
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.judge_process import JudgeProcess
from pytest_garl.execution.reference import (
    BUILT_IN,
    simulator_sha256,
    system_named,
)
from pytest_garl.execution.sources import sources_sha256
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.program import AnySystem
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map

ReplayResult = Literal["FIXED", "FAILED", "STALE", "UNDECIDED"]
BUILT_IN_VERDICT = "the built-in verdict"
GAVE_UP = "the landing system gave up"


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """The replay of a case: it fails, is fixed, passes without proof, or is not decided.

    ``reasons`` say why it is stale or undecided, or which test failed.  ``judged_by`` names the
    tests, or the built-in verdict.  ``same_flight`` is whether the flight equals the recorded one
    to the byte; None if it was recorded by another engine or on another class of CPUs, or if the
    flight's process ended early; then ``flight`` may be None as well.
    """

    result: ReplayResult
    outcome: str
    signature: str
    description: str
    judged_by: str
    reasons: tuple[str, ...]
    flight: Flight | None
    map: Map
    same_flight: bool | None


def system_of(case: Case, folder: Path) -> AnySystem:
    """Return the landing system, imported as from ``folder``, or raise LandingSystemError."""
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    try:
        system: AnySystem = system_named(case.system)
    except LandingSystemError as error:
        raise LandingSystemError(
            f"system {case.system!r}: cannot be imported from {folder} ({error}); run this where "
            "your landing tests are run, or correct the case's key 'system'"
        ) from error
    return system


def replay(
    case: Case, folder: Path, map_folders: tuple[Path, ...] = (), *, live: bool = False
) -> Replay:
    """Fly a case with its recorded moves, or with a ``live`` policy, and judge it.

    The tests in the file of the test that found it judge; without a test, the built-in verdict.
    Raises GarlError if it cannot be flown, or if the test of a user's own property is not found.
    """
    found = _replay(case, folder, load_map(case.scenario.map, map_folders), live)
    if not case.of_another_engine:
        return found
    if found.result in ("FIXED", "STALE"):
        reason = f"it passes on another engine: {case.of_another_engine}"
        return dataclasses.replace(found, result="UNDECIDED", reasons=(reason,))
    return dataclasses.replace(found, reasons=(*found.reasons, case.of_another_engine))


def _replay(case: Case, folder: Path, map: Map, live: bool) -> Replay:
    if not case.test:
        judged_by = f"{BUILT_IN_VERDICT}: the case names no test"
        return _by_verdict(case, folder, map, judged_by, live)
    with run_case_tests(case, folder, live=live) as (results, flights):
        finder = next((each for each in results if each.is_result_of(case.test)), None)
        if finder is not None:
            return _by_tests(case, map, results, finder, flights, live)
    if case.assertion:
        raise GarlError(
            f"the case {case.id} tests a property of your own, but its test {case.test!r} is not "
            f"found in {folder}; run this where you run pytest, or correct the case's key 'test'"
        )
    judged_by = f"{BUILT_IN_VERDICT}: the test {case.test} is not found in {folder}"
    return _by_verdict(case, folder, map, judged_by, live)


def _by_tests(
    case: Case,
    map: Map,
    results: tuple[CaseTestResult, ...],
    finder: CaseTestResult,
    flights: Path,
    live: bool,
) -> Replay:
    failed = [each for each in results if each.outcome == "failed"]
    properties = (failed[0] if failed else finder).properties
    outcome = properties.get("garl.outcome", "")
    reasons: tuple[str, ...] = ()
    result: ReplayResult = "FIXED"
    if outcome == "inconclusive":
        result, reasons = "UNDECIDED", (finder.message or "the flight is inconclusive",)
    elif failed:
        result = "FAILED"
        reasons = tuple(f"{each.nodeid.rpartition('.')[2]}: {each.message}" for each in failed)
    elif excuse := properties.get("garl.excuse", ""):
        result, reasons = "UNDECIDED", (_excused(excuse),)
    elif outcome == "gave_up" and properties.get("garl.signature", ""):
        result, reasons = "FAILED", (f"{GAVE_UP} although somebody could have landed",)
    elif finder.outcome == "skipped":
        result, reasons = "UNDECIDED", (f"its test was skipped: {finder.message}",)
    elif stale := properties.get("garl.unproven", ""):
        result, reasons = "STALE", (stale,)
    flight = _recorded_flight(flights, properties.get("garl.trajectory_sha256", ""))
    return Replay(
        result=result,
        outcome=outcome,
        signature=properties.get("garl.signature", ""),
        description=properties.get("garl.story", ""),
        judged_by=f"{case.test} and the tests beside it",
        reasons=reasons,
        flight=flight,
        map=map,
        same_flight=_is_same(case, flight, live),
    )


def _recorded_flight(folder: Path, sha256: str) -> Flight | None:
    """Return the flight with a hash in a folder of records; the first one without a hash."""
    flights = (load(path) for path in sorted(folder.glob("*.npz")))
    return next((each for each in flights if not sha256 or each.sha256 == sha256), None)


def _by_verdict(case: Case, folder: Path, map: Map, judged_by: str, live: bool) -> Replay:
    from pytest_garl.simulation.fly import fly

    with JudgeProcess() as judge:
        with refusing_end(case.system):
            system = system_of(case, folder)
            cpu_dispatch.check()
            npcs = policy_spec(case.policy) if live else case.behaviour.policy
            limit_s = time_limit_s(case.limits)
            flight = fly(case.scenario, system, npcs, map=map, time_limit_s=limit_s)
        judged = judge.judge_flight(flight, case.limits)
    verdict = judged.verdict
    sources = SourceHashes(
        system_sha256=sources_sha256(system),
        simulator_sha256=simulator_sha256(BUILT_IN),
        map_sha256=map.sha256,
    )
    reasons: tuple[str, ...] = ()
    result: ReplayResult = "FIXED"
    if verdict.violation:
        result = "FAILED"
    elif verdict.excuse:
        result, reasons = "UNDECIDED", (_excused(verdict.excuse_text or verdict.excuse),)
    elif reasons := stale_reasons(case, sources, flight.sha256):
        result = "STALE"
    return Replay(
        result=result,
        outcome=judged.outcome,
        signature=verdict.signature,
        description=verdict.story,
        judged_by=judged_by,
        reasons=reasons,
        flight=flight,
        map=map,
        same_flight=_is_same(case, flight, live),
    )


def _excused(excuse: str) -> str:
    return f"nobody could have landed, so it proves no repair: {excuse}"


def _is_same(case: Case, flight: Flight | None, live: bool) -> bool | None:
    recorded = case.evidence.trajectory_sha256
    if live or flight is None or not recorded or case.evidence.cpu != flight.cpu:
        return None
    if engine_of(flight.versions) not in (None, case.evidence.engine):
        return None
    return flight.sha256 == recorded


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceHashes:
    """Hashes of the landing system, the simulator and the map that fly a case."""

    system_sha256: str
    simulator_sha256: str
    map_sha256: str

    @classmethod
    def of(cls, evidence: CaseEvidence) -> Self:
        """Return the hashes of the sources that gave the evidence."""
        return cls(
            system_sha256=evidence.system_sha256,
            simulator_sha256=evidence.simulator_sha256,
            map_sha256=evidence.map_sha256,
        )

    @classmethod
    def of_job(cls, job: FlightJob) -> Self:
        """Return the hashes of the sources with which a job flies."""
        return cls(
            system_sha256=job.system_sha256,
            simulator_sha256=simulator_sha256(job.simulator),
            map_sha256=job.map_sha256,
        )


def stale_reasons(case: Case, sources: SourceHashes, trajectory_sha256: str) -> tuple[str, ...]:
    """Return why a pass of the case proves nothing; empty if the landing system was repaired.

    A repair is a change of the landing system that changes the flight.  If the simulator or the map
    changed as well, either may be the reason why the case passes.
    """
    evidence = case.evidence
    if trajectory_sha256 and trajectory_sha256 == evidence.trajectory_sha256:
        return ("the flight is the recorded one to the byte: the test changed, or its limits",)
    found = []
    if sources.map_sha256 != evidence.map_sha256:
        found.append(f"the map {case.scenario.map!r} has changed")
    if sources.simulator_sha256 != evidence.simulator_sha256:
        found.append("the simulator has changed")
    if not found and evidence.system_sha256 == sources.system_sha256:
        found.append(
            "the flight is another, but neither the landing system nor the simulator has changed"
        )
    return tuple(found)
