from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from pytest_garl.execution import reference


def fresh() -> str:
    """Hash this package; within a process that is done once."""
    reference.package_sha256.cache_clear()
    return reference.package_sha256()


def test_the_package_is_known_by_what_shapes_a_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = Path(reference.__file__).parents[1]
    copy = tmp_path / "pytest_garl"
    shutil.copytree(home, copy, ignore=shutil.ignore_patterns("__pycache__"))
    here = fresh()
    assert re.fullmatch("[0-9a-f]{64}", here)
    monkeypatch.setattr(reference, "__file__", str(copy / "execution" / "reference.py"))
    assert fresh() == here
    (copy / "plugin" / "summary.py").write_text("")
    (copy / "verdicts" / "notes.txt").write_text("")
    assert fresh() == here
    (copy / "scenarios" / "maps" / "court.toml").write_text("")
    changed = fresh()
    assert changed != here
    (copy / "verdicts" / "judge.py").rename(copy / "verdicts" / "jury.py")
    assert fresh() != changed
