"""``garl cases renew``: a repair can be FIXED after an upgrade."""

from __future__ import annotations

import dataclasses
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import replace_file
from tests.support.case_project import let_system_avoid_dog, replace_text

UPGRADE = "\n\ndef new_in_this_version():\n    return 1\n"
"""A change of the simulator that matters to no flight."""


@pytest.fixture
def project(searched_template: Path, tmp_path: Path) -> Path:
    """Return a project with two saved cases, a dog and fog."""
    folder = tmp_path / "project"
    shutil.copytree(searched_template, folder)
    return folder


@pytest.fixture
def dog(project: Path) -> Path:
    (path,) = (project / "scenarios/regressions/systems").glob("lawn-IV-dog-*.toml")
    return path


def upgrade(project: Path) -> None:
    path = project / "tiny_simulator.py"
    path.write_text(path.read_text() + UPGRADE)


def run(project: Path, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    inherited = {key: value for key, value in os.environ.items() if key != "CI"}
    return subprocess.run(
        [sys.executable, *command],
        cwd=project,
        env=inherited | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def garl(project: Path, *args: str | Path) -> subprocess.CompletedProcess[str]:
    start = "from pytest_garl.cli import main; main()"
    return run(project, "-c", start, "cases", *map(str, args))


def fly(project: Path, *args: str, **environment: str) -> str:
    """Run pytest, which flies the saved cases; return its output."""
    command = ("-m", "pytest", "-p", "no:cacheprovider", "--garl-workers=0", *args)
    return run(project, *command, **environment).stdout


def test_a_repair_after_an_upgrade_is_stale_until_the_case_is_renewed(
    project: Path, dog: Path
) -> None:
    upgrade(project)
    before = load_case(dog)
    done = garl(project, "renew", "--workers=0")
    assert (done.returncode, done.stdout) == (0, "2 cases: 2 renewed\n")
    renewed = load_case(dog)
    assert renewed.evidence.simulator_sha256 != before.evidence.simulator_sha256
    back = before.evidence.simulator_sha256
    assert dataclasses.replace(renewed.evidence, simulator_sha256=back) == before.evidence
    assert dataclasses.replace(renewed, evidence=before.evidence) == before
    assert garl(project, "renew", "--workers=0").stdout == "2 cases: 2 current\n"
    let_system_avoid_dog(project)
    assert garl(project, "replay", dog).stdout.startswith("FIXED")
    replace_file(dog, before)
    stale = garl(project, "replay", dog)
    assert stale.stdout.startswith("STALE")
    assert "the simulator has changed" in stale.stdout


def test_a_run_that_flies_a_case_to_the_byte_proves_its_reference(
    project: Path, dog: Path, tmp_path: Path
) -> None:
    upgrade(project)
    text = dog.read_text()
    summary = tmp_path / "summary.md"
    output = fly(project, GITHUB_STEP_SUMMARY=str(summary))
    line = "2 cases carry another version's hash and fly as recorded: garl cases renew"
    assert line in output
    assert line in summary.read_text()
    assert dog.read_text() == text
    let_system_avoid_dog(project)
    repaired = fly(project)
    assert f"maybe fixed: {dog.relative_to(project)} passes" in repaired
    assert "stale" not in repaired
    # Both cases are flown anew by the repaired system; only the fog still fails.
    assert garl(project, "replay", dog).stdout.startswith("FIXED")
    promoted = garl(project, "promote", dog)
    assert promoted.returncode == 0, promoted.stdout
    assert load_case(dog).status == "fixed"


def test_without_an_upgrade_no_line_asks_for_a_renewal(project: Path) -> None:
    assert "garl cases renew" not in fly(project)
    assert not (project / ".garl" / "renewals.jsonl").exists()


def test_xdist_notes_the_proofs_of_its_workers(project: Path) -> None:
    pytest.importorskip("xdist")
    upgrade(project)
    assert "2 cases carry another version's hash" in fly(project, "-n2")


def test_a_flight_that_differs_is_never_renewed(project: Path, dog: Path) -> None:
    upgrade(project)
    before = {path: path.read_text() for path in dog.parent.iterdir()}
    let_system_avoid_dog(project)
    done = garl(project, "renew", dog, "--workers=0")
    assert done.returncode == 1
    assert f"{dog}: it does not fail any more" in done.stderr
    assert "not renewed" in done.stdout
    assert {path: path.read_text() for path in dog.parent.iterdir()} == before


def test_a_new_signature_renames_the_file(project: Path, dog: Path) -> None:
    case = load_case(dog)
    old = dataclasses.replace(
        case,
        violation=dataclasses.replace(case.violation, signature="IV:dog:old", description="Old."),
        evidence=dataclasses.replace(case.evidence, simulator_sha256="00" * 32),
    )
    path = replace_file(dog, old)
    assert path != dog
    done = garl(project, "renew", path.relative_to(project), "--workers=0")
    assert done.returncode == 0
    assert f"systems/{path.stem}" in done.stdout
    assert "IV:dog:old" in done.stdout
    assert dog.stem in done.stdout
    assert "1 cases: 1 renamed" in done.stdout
    assert "git add -A scenarios/regressions" in done.stdout
    assert not path.exists()
    assert load_case(dog) == case


def test_a_fixed_case_needs_no_renewal(project: Path, dog: Path) -> None:
    replace_text(dog, 'status = "open"', 'status = "fixed"')
    upgrade(project)
    done = garl(project, "renew", "--workers=0")
    assert (done.returncode, done.stdout) == (0, "2 cases: 1 renewed, 1 fixed\n")
