"""A flight is judged where its landing system's code never ran: replacing the judge is no use."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.execution.ledger import Ledger
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS
from tests.support import bent_judges
from tests.support.broken_lander import case_of_broken_lander
from tests.support.landing_project import project, run

REPLACING = ("LandsAtHome", "ReplacesTheResult", "ReplacesTheJudge")
TESTS = """
import pytest
from bent_judges import {system}

@pytest.mark.garl(system={system}, maps=["lawn"])
def test_distance(landing):
    assert landing.distance_to_landing_m <= landing.limits.distance_m
"""
AT_IMPORT = "\n{system}().replace()\n"


def stories(folder: Path) -> dict[str, set[str]]:
    """Return what the ledger tells of the violations of each system."""
    ledger = Ledger(folder / ".garl" / "ledger.sqlite")
    try:
        found: dict[str, set[str]] = {}
        for row in ledger.queries.violating():
            name = row.system.rpartition(":")[2]
            found.setdefault(name, set()).add(row.result.verdict.story)
        return found
    finally:
        ledger.close()


def fly(pytester: pytest.Pytester, systems: tuple[str, ...], end: str, workers: int) -> int:
    """Search with a test of each system, whose file ends with a line; return pytest's status."""
    project(pytester)
    shutil.copy(bent_judges.__file__, pytester.path)
    (pytester.path / "test_it.py").unlink()
    for system in systems:
        text = TESTS.format(system=system) + end.format(system=system)
        (pytester.path / f"test_{system}.py").write_text(text)
    return int(run(pytester, "--garl-budget=2", f"--garl-workers={workers}").ret)


@pytest.mark.parametrize(
    ("workers", "end"),
    [
        (0, ""),
        (1, AT_IMPORT),
        pytest.param(1, "", marks=pytest.mark.long),
        pytest.param(0, AT_IMPORT, marks=pytest.mark.long),
    ],
)
def test_replaced_judge_is_no_use(pytester: pytest.Pytester, workers: int, end: str) -> None:
    assert fly(pytester, REPLACING, end, workers) == pytest.ExitCode.TESTS_FAILED
    found = stories(pytester.path)
    assert found["LandsAtHome"]
    assert found == dict.fromkeys(REPLACING, found["LandsAtHome"])


def test_bent_arithmetic_bends_no_verdict(pytester: pytest.Pytester) -> None:
    systems = ("LandsAtHome", "BendsArithmetic")
    assert fly(pytester, systems, "", workers=1) == pytest.ExitCode.TESTS_FAILED
    found = stories(pytester.path)
    assert found == dict.fromkeys(systems, found["LandsAtHome"])


def test_bent_arithmetic_is_not_green_without_workers(pytester: pytest.Pytester) -> None:
    """It bends pytest itself there, and what breeds scenarios."""
    assert fly(pytester, ("BendsArithmetic",), "", workers=0) != pytest.ExitCode.OK


def garl(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own, in which the landing system replaces the judge."""
    shutil.copy(bent_judges.__file__, folder)
    command = [sys.executable, "-c", "from pytest_garl.cli import main; main()", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_replaced_judge_bends_no_check(tmp_path: Path) -> None:
    done = garl(tmp_path, "check", "bent_judges:SeesNothing", "--seconds=3")
    assert "SeesNothing: lawn: cut off" in done.stdout, done.stdout + done.stderr
    assert "All is well" not in done.stdout


@pytest.mark.parametrize("system", ["SeesNothing", "MeasuresNothing"])
def test_replaced_judge_bends_no_replay(tmp_path: Path, system: str) -> None:
    case = case_of_broken_lander()
    path = Corpus(tmp_path / "scenarios" / "regressions").save(
        dataclasses.replace(case, system=f"bent_judges:{system}", limits=DEFAULT_LIMITS)
    )
    assert path is not None
    done = garl(tmp_path, "cases", "replay", str(path))
    assert (done.returncode, done.stdout[:7]) == (1, "FAILED\n"), done.stdout + done.stderr
    assert "All is well" not in done.stdout
