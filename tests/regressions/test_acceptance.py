from __future__ import annotations

import dataclasses
import subprocess
from pathlib import Path

import pytest

from pytest_garl.regressions.acceptance import read_acceptance
from tests.regressions.samples import case


def test_cases_in_the_index_of_git_are_accepted(tmp_path: Path) -> None:
    file = tmp_path / "cases" / "landing" / "a.toml"
    file.parent.mkdir(parents=True)
    file.touch()
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    assert not read_acceptance(tmp_path / "cases").accepts(file, case())
    subprocess.run(["git", "add", str(file)], cwd=tmp_path, check=True)
    assert read_acceptance(tmp_path / "cases").accepts(file, case())
    assert not read_acceptance(tmp_path / "cases").accepts(file.with_name("b.toml"), case())


def test_marked_cases_are_accepted_without_git(tmp_path: Path) -> None:
    acceptance = read_acceptance(tmp_path)
    assert "not a git repository" in acceptance.problem
    assert not acceptance.accepts(tmp_path / "a.toml", case())
    marked = dataclasses.replace(case(), accepted=True)
    assert acceptance.accepts(tmp_path / "a.toml", marked)


def test_missing_git_is_the_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert read_acceptance(tmp_path).problem.startswith("git: No such file")
