"""The census looks for test files where a project has them, and nowhere else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pytest_garl.cases.census import marked_test_files

MARKED = "import pytest\npytestmark = pytest.mark.garl(system=None)\n"


def test_it_looks_into_no_folder_that_is_not_the_projects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("", "tests", "venv/lib", ".hidden", "build", "__pycache__"):
        (tmp_path / name).mkdir(parents=True, exist_ok=True)
        (tmp_path / name / "test_it.py").write_text(MARKED)
    (tmp_path / "venv" / "pyvenv.cfg").touch()
    locked = tmp_path / "database"
    locked.mkdir()
    stat = Path.stat

    def refused(self: Path, **more: Any) -> Any:
        if self.parent == locked:
            raise PermissionError(13, "Permission denied")
        return stat(self, **more)

    # As a folder of another user does: root, who may run this test, may look into it.
    monkeypatch.setattr(Path, "stat", refused)
    found = marked_test_files(tmp_path, ["test_*.py"], ["build"])
    assert found == ["test_it.py", "tests/test_it.py"]
