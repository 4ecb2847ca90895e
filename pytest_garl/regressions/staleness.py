"""Staleness: a saved case passes, but nothing proves that the landing system was repaired."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from typing import Self

from pytest_garl.regressions.case import Case, Evidence


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceHashes:
    """Hashes of the landing system, the simulator and the map that fly a case."""

    system_sha256: str
    simulator_sha256: str
    map_sha256: str

    @classmethod
    def of(cls, evidence: Evidence) -> Self:
        """Return the hashes of the sources that gave the evidence."""
        return cls(
            system_sha256=evidence.system_sha256,
            simulator_sha256=evidence.simulator_sha256,
            map_sha256=evidence.map_sha256,
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
    if evidence.simulator_sha256:
        if sources.simulator_sha256 != evidence.simulator_sha256:
            found.append("the simulator has changed")
    else:
        found += _other_version(case)
    if not found and evidence.system_sha256 == sources.system_sha256:
        found.append(
            "the flight is another, but neither the landing system nor the simulator has changed"
        )
    return tuple(found)


def _other_version(case: Case) -> list[str]:
    """Return the change of version, for a case that has no hash of the simulator's sources."""
    then, today = dict(case.evidence.versions).get("pytest-garl", ""), version("pytest-garl")
    return [f"pytest-garl was {then} and is {today}"] if then and then != today else []
