from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from pytest_garl.execution import reference

NOT_HASHED = (
    "__init__.py",
    "cases",
    "cli",
    "errors.py",
    "gate",
    "messages.py",
    "plugin",
    "reports",
    "shrinking",
    "testing.py",
    "triage",
)
"""Folders and modules of the package that start searches or show their results."""


def fresh() -> str:
    """Hash this package; within a process that is done once."""
    reference.package_sha256.cache_clear()
    return reference.package_sha256()


def test_the_hash_changes_with_the_files_that_shape_a_search_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = Path(reference.__file__).parents[1]
    copy = tmp_path / "pytest_garl"
    shutil.copytree(home, copy, ignore=shutil.ignore_patterns("__pycache__"))
    here = fresh()
    assert re.fullmatch("[0-9a-f]{64}", here)
    monkeypatch.setattr(reference, "__file__", str(copy / "execution" / "reference.py"))
    assert fresh() == here
    (copy / "plugin" / "terminal" / "summary.py").write_text("")
    (copy / "verdicts" / "notes.txt").write_text("")
    assert fresh() == here
    (copy / "scenarios" / "maps" / "court.toml").write_text("")
    changed = fresh()
    assert changed != here
    (copy / "verdicts" / "judge.py").rename(copy / "verdicts" / "jury.py")
    assert fresh() != changed


def test_every_folder_and_module_is_either_hashed_or_listed_as_not_hashed() -> None:
    home = Path(reference.__file__).parents[1]
    found = [
        place.name
        for place in home.iterdir()
        if place.suffix == ".py" or (place.is_dir() and any(place.rglob("*.py")))
    ]
    assert sorted(found) == sorted([*reference.HASHED, *NOT_HASHED])


def test_every_data_file_in_a_hashed_folder_has_a_hashed_suffix() -> None:
    """Weights also have a manifest in JSON, which says how they were trained."""
    home = Path(reference.__file__).parents[1]
    suffixes = {
        file.suffix
        for name in reference.HASHED
        for file in (home / name).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    assert suffixes == {".json", *reference.HASHED_SUFFIXES}
