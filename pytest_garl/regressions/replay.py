"""Fly a saved case again, without pytest and without a ledger."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from pytest_garl.adversary.policies import policy_spec
from pytest_garl.adversary.recorded import recorded_spec
from pytest_garl.errors import LandingSystemError
from pytest_garl.regressions.case import Case
from pytest_garl.scenarios.maps import Map, load_map
from pytest_garl.search.job import PAPER_LIMIT_S
from pytest_garl.search.reference import system_named
from pytest_garl.simulation.flight import Flight
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Verdict

Answer = Literal["FIXED", "FAILED", "STALE"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """What a case came to: it fails, is fixed, or says nothing since the world has changed.

    ``same`` is whether the flight is the recorded one to the byte; None where it was recorded on
    another class of CPUs or its process did not live.
    """

    answer: Answer
    verdict: Verdict
    flight: Flight
    map: Map
    changed: tuple[str, ...]
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
            "your landing tests are run, or mend the case's key 'system'"
        ) from error
    return system


def replay(
    case: Case, folder: Path, map_folders: tuple[Path, ...] = (), *, live: bool = False
) -> Replay:
    """Fly a case with its recorded moves, or with a ``live`` policy, and answer what it shows."""
    map = load_map(case.scenario.map, map_folders)
    system = system_of(case, folder)
    npcs = policy_spec(case.policy) if live else recorded_spec(dict(case.moves), dict(case.changes))
    limit = max(PAPER_LIMIT_S, case.limits.time_s)
    flight = fly(case.scenario, system, npcs, map=map, time_limit_s=limit)
    verdict = judge(flight, case.limits)
    changed = changes(case, map)
    comparable = not live and case.evidence.trajectory_sha256 and case.evidence.cpu == flight.cpu
    return Replay(
        answer=_answer(verdict, changed),
        verdict=verdict,
        flight=flight,
        map=map,
        changed=changed,
        same=flight.sha256 == case.evidence.trajectory_sha256 if comparable else None,
    )


def _answer(verdict: Verdict, changed: tuple[str, ...]) -> Answer:
    if verdict.violation:
        return "FAILED"
    return "STALE" if changed else "FIXED"


def changes(case: Case, map: Map) -> tuple[str, ...]:
    """Return what of the world is not as it was: then to pass proves nothing."""
    found = []
    if map.sha256 != case.evidence.map_sha256:
        found.append(f"the map {map.name!r} has changed")
    then, today = dict(case.evidence.versions).get("pytest-garl", ""), version("pytest-garl")
    if then and then != today:
        found.append(f"pytest-garl was {then} and is {today}")
    return tuple(found)
