"""`make test-others` tests on every other supported Python that is installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PRESENT = f"{sys.version_info.major}.{sys.version_info.minor}"


@pytest.fixture
def make(tmp_path: Path) -> list[str]:
    """Return the command, with a home folder that has no Python."""
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    return ["make", "--silent", "test-others", f"PYTHON={sys.executable}", f"HOME={tmp_path}"]


def output_of(command: list[str]) -> str:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_machine_without_another_python_passes_and_says_so(make: list[str]) -> None:
    shown = output_of([*make, f"SUPPORTED={PRESENT} 9.9"])
    assert shown == f"Tested on: no other Python: of {PRESENT} 9.9 only {PRESENT} is installed\n"


def test_another_python_gets_an_environment_and_its_tests(make: list[str], tmp_path: Path) -> None:
    python = tmp_path / ".pyenv" / "versions" / "9.9.1" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.symlink_to(sys.executable)
    # What would be run: make prints it.
    shown = output_of([*make, f"SUPPORTED={PRESENT} 9.9", "--dry-run"])
    assert f"{python} -m venv --clear .venvs/9.9" in shown
    assert '.venvs/9.9/bin/pytest -n 2 --dist=worksteal -m "not sim' in shown
    assert "tests/landing_systems/test_saved_cases.py" in shown
    assert "Tested on: 9.9" in shown
