"""What it proves that a saved case passes: that the system was repaired, or nothing."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version

from pytest_garl.regressions.case import Case


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """Hashes of what a case is flown with: the landing system, the simulator, the map."""

    system_sha256: str
    simulator_sha256: str
    map_sha256: str


def unproven(case: Case, sources: Sources, trajectory_sha256: str) -> tuple[str, ...]:
    """Return why it proves nothing that a case passes; nothing if the system was repaired.

    A repair is a change of the landing system that changes the flight.  If the simulator or the map
    changed as well, nobody knows which of them made the case pass.
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
    """Return what tells the simulator's change in a case that has no hash of its sources."""
    then, today = dict(case.evidence.versions).get("pytest-garl", ""), version("pytest-garl")
    return [f"pytest-garl was {then} and is {today}"] if then and then != today else []
