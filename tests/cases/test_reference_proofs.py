"""Proofs that other sources than a case's fly it to the byte."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from pytest_garl.cases.reference_proofs import (
    Proofs,
    proves_reference,
    renewal_line,
    with_sources,
)
from pytest_garl.cases.replay import SourceHashes, stale_reasons
from tests.cases.samples import case

CASE = with_sources(
    case(), SourceHashes(system_sha256="11", simulator_sha256="22", map_sha256="33")
)
FLOWN = CASE.evidence.trajectory_sha256
UPGRADED = SourceHashes(system_sha256="11", simulator_sha256="55", map_sha256="33")
REPAIRED = dataclasses.replace(UPGRADED, system_sha256="44")


def test_the_same_flight_with_other_sources_is_a_proof() -> None:
    assert proves_reference(CASE, UPGRADED, FLOWN)
    assert not proves_reference(CASE, UPGRADED, "ee" * 32)
    assert not proves_reference(CASE, SourceHashes.of(CASE.evidence), FLOWN)
    fixed = dataclasses.replace(CASE, status="fixed")
    assert not proves_reference(fixed, UPGRADED, FLOWN)
    unrecorded = dataclasses.replace(
        CASE, evidence=dataclasses.replace(CASE.evidence, trajectory_sha256="")
    )
    assert not proves_reference(unrecorded, UPGRADED, "")


def test_a_change_of_the_landing_system_alone_needs_no_proof() -> None:
    changed = dataclasses.replace(SourceHashes.of(CASE.evidence), system_sha256="cc" * 32)
    assert not proves_reference(CASE, changed, FLOWN)


def test_a_proof_makes_a_later_pass_a_repair(tmp_path: Path) -> None:
    assert stale_reasons(CASE, REPAIRED, "ee" * 32) == ("the simulator has changed",)
    Proofs(tmp_path).note(CASE, UPGRADED)
    renewed = Proofs(tmp_path).renewed(CASE)
    assert SourceHashes.of(renewed.evidence) == UPGRADED
    assert stale_reasons(renewed, REPAIRED, "ee" * 32) == ()
    # Without a repair the pass of the upgraded simulator proves nothing.
    assert stale_reasons(renewed, UPGRADED, "ee" * 32) != ()


def test_a_proof_holds_for_its_flight_only(tmp_path: Path) -> None:
    Proofs(tmp_path).note(CASE, UPGRADED)
    other = dataclasses.replace(
        CASE, evidence=dataclasses.replace(CASE.evidence, trajectory_sha256="ee" * 32)
    )
    assert Proofs(tmp_path).renewed(other) == other


def test_the_last_proof_counts_and_each_is_written_once(tmp_path: Path) -> None:
    proofs = Proofs(tmp_path)
    for sources in (UPGRADED, UPGRADED, REPAIRED):
        proofs.note(CASE, sources)
    lines = (tmp_path / "renewals.jsonl").read_text().splitlines()
    assert len(lines) == 2
    assert SourceHashes.of(Proofs(tmp_path).renewed(CASE).evidence) == REPAIRED


def test_a_damaged_line_proves_nothing(tmp_path: Path) -> None:
    (tmp_path / "renewals.jsonl").write_text('{"case": "x"\n[]\n{"case": "a", "b": 1}\n\xff\n')
    assert Proofs(tmp_path).renewed(CASE) == CASE


def test_the_line_counts_cases() -> None:
    assert renewal_line(0) == ""
    assert renewal_line(1).startswith("1 case carries another version's hash and flies")
    assert renewal_line(57).startswith("57 cases carry another version's hash and fly")
