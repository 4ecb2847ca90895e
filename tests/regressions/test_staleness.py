from __future__ import annotations

import dataclasses

from pytest_garl.regressions.staleness import SourceHashes, stale_reasons
from tests.regressions.samples import case

PLAIN = case()
CASE = dataclasses.replace(
    PLAIN,
    evidence=dataclasses.replace(PLAIN.evidence, system_sha256="ef" * 32, simulator_sha256="12"),
)
SOURCES = SourceHashes.of(CASE.evidence)


def test_pass_after_a_change_of_the_landing_system_is_not_stale() -> None:
    repaired = dataclasses.replace(SOURCES, system_sha256="00" * 32)
    assert stale_reasons(CASE, repaired, "another flight") == ()


def test_identical_flight_is_stale() -> None:
    (reason,) = stale_reasons(CASE, SOURCES, CASE.evidence.trajectory_sha256)
    assert reason.startswith("the flight is the recorded one to the byte")


def test_other_flight_with_the_same_sources_is_stale() -> None:
    (reason,) = stale_reasons(CASE, SOURCES, "another flight")
    assert "neither the landing system nor the simulator has changed" in reason


def test_changes_of_map_and_simulator_are_both_named() -> None:
    changed = dataclasses.replace(SOURCES, map_sha256="", simulator_sha256="")
    assert stale_reasons(CASE, changed, "another flight") == (
        "the map 'lawn' has changed",
        "the simulator has changed",
    )


def test_case_without_a_hash_of_the_simulator_compares_versions() -> None:
    evidence = dataclasses.replace(PLAIN.evidence, versions=(("pytest-garl", "0.0.1"),))
    old = dataclasses.replace(PLAIN, evidence=evidence)
    (reason,) = stale_reasons(old, SourceHashes.of(evidence), "another flight")
    assert reason.startswith("pytest-garl was 0.0.1 and is ")
