"""Fly a saved case again, and answer whether it is fixed."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.errors import GarlError, LandingSystemError
from pytest_garl.execution.reference import (
    BUILT_IN,
    simulator_sha256,
    system_named,
)
from pytest_garl.execution.sources import sources_sha256
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.judging import Judged, is_test, judged
from pytest_garl.regressions.staleness import SourceHashes, stale_reasons
from pytest_garl.scenarios.maps.map import Map, load_map
from pytest_garl.simulation.flight import Flight
from pytest_garl.simulation.flight_file import load
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import PAPER_LIMITS

Answer = Literal["FIXED", "FAILED", "STALE", "UNDECIDED"]
BUILT_IN_VERDICT = "the built-in verdict"


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """What a case came to: it fails, is fixed, passes without proof, or nobody can tell.

    ``reasons`` say why it is stale or undecided, or which test failed.  ``judge`` is who decided.
    ``same`` is whether the flight is the recorded one to the byte; None where it was recorded on
    another class of CPUs or its process did not live, and then ``flight`` may be None as well.
    """

    answer: Answer
    outcome: str
    signature: str
    description: str
    judge: str
    reasons: tuple[str, ...]
    flight: Flight | None
    map: Map
    same: bool | None


def system_of(case: Case, folder: Path) -> type:
    """Return the landing system's class, imported as from ``folder``."""
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    try:
        system: type = system_named(case.system)
    except LandingSystemError as error:
        raise LandingSystemError(
            f"system {case.system!r}: cannot be imported from {folder} ({error}); run this where "
            "your landing tests are run, or correct the case's key 'system'"
        ) from error
    return system


def replay(
    case: Case, folder: Path, map_folders: tuple[Path, ...] = (), *, live: bool = False
) -> Replay:
    """Fly a case with its recorded moves, or with a ``live`` policy, and answer what it shows.

    The tests of the file in which it was found judge; the built-in verdict where no test is known.
    """
    map = load_map(case.scenario.map, map_folders)
    if not case.test:
        return _by_verdict(case, folder, map, f"{BUILT_IN_VERDICT}: the case names no test", live)
    with judged(case, folder, live=live) as (found, flights):
        finder = next((each for each in found if is_test(each, case.test)), None)
        if finder is not None:
            return _by_tests(case, map, found, finder, flights, live)
    if case.assertion:
        raise GarlError(
            f"the case {case.id} is of a property of your own, and its test {case.test!r} is not "
            f"found in {folder}; run this where you run pytest, or correct the case's key 'test'"
        )
    judge = f"{BUILT_IN_VERDICT}: the test {case.test} is not found in {folder}"
    return _by_verdict(case, folder, map, judge, live)


def _by_tests(
    case: Case, map: Map, found: tuple[Judged, ...], finder: Judged, flights: Path, live: bool
) -> Replay:
    failed = [each for each in found if each.outcome == "failed"]
    facts = (failed[0] if failed else finder).facts
    outcome, trajectory = facts.get("garl.outcome", ""), facts.get("garl.trajectory_sha256", "")
    reasons: tuple[str, ...] = ()
    answer: Answer = "FIXED"
    if outcome == "inconclusive":
        answer, reasons = "UNDECIDED", (finder.message or "the flight is inconclusive",)
    elif failed:
        answer = "FAILED"
        reasons = tuple(f"{each.nodeid.rpartition('.')[2]}: {each.message}" for each in failed)
    elif finder.outcome == "skipped" and outcome != "aborted":
        answer, reasons = "UNDECIDED", (f"its test was skipped: {finder.message}",)
    elif stale := facts.get("garl.unproven", ""):
        answer, reasons = "STALE", (stale,)
    flight = next(
        (each for each in _records(flights) if not trajectory or each.sha256 == trajectory), None
    )
    return Replay(
        answer=answer,
        outcome=outcome,
        signature=facts.get("garl.signature", ""),
        description=facts.get("garl.story", ""),
        judge=f"{case.test} and the tests beside it",
        reasons=reasons,
        flight=flight,
        map=map,
        same=_same(case, flight, live),
    )


def _records(folder: Path) -> list[Flight]:
    """Return the flights in a folder."""
    return [load(path) for path in sorted(folder.glob("*.npz"))]


def _by_verdict(case: Case, folder: Path, map: Map, judged_by: str, live: bool) -> Replay:
    system = system_of(case, folder)
    cpu_dispatch.check()
    npcs = policy_spec(case.policy) if live else case.behaviour.policy
    limit = max(PAPER_LIMITS.time_s, case.limits.time_s)
    flight = fly(case.scenario, system, npcs, map=map, time_limit_s=limit)
    verdict = judge(flight, case.limits)
    sources = SourceHashes(
        system_sha256=sources_sha256(system),
        simulator_sha256=simulator_sha256(BUILT_IN),
        map_sha256=map.sha256,
    )
    reasons = () if verdict.violation else stale_reasons(case, sources, flight.sha256)
    answer: Answer = "STALE" if reasons else "FIXED"
    return Replay(
        answer="FAILED" if verdict.violation else answer,
        outcome=flight.outcome,
        signature=verdict.signature,
        description=verdict.story,
        judge=judged_by,
        reasons=reasons,
        flight=flight,
        map=map,
        same=_same(case, flight, live),
    )


def _same(case: Case, flight: Flight | None, live: bool) -> bool | None:
    recorded = case.evidence.trajectory_sha256
    if live or flight is None or not recorded or case.evidence.cpu != flight.cpu:
        return None
    return flight.sha256 == recorded
