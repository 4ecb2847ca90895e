"""Projects that several tests of sessions copy."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import cv2  # noqa: F401  (a run of pytester forgets what it imports first; OpenCV imports only once)
import pytest

from tests.support.case_project import (
    SEARCH,
    add_cases_to_git,
)
from tests.support.landing_project import write_project


@pytest.fixture(scope="session")
def searched_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project whose search has saved two cases, which are committed: a dog, and fog."""
    folder = tmp_path_factory.mktemp("searched")
    write_project(folder)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *SEARCH]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stdout
    assert "confirming and shrinking 2 new kinds of violation" in done.stdout
    assert "saved scenarios/regressions/systems/lawn-IV-dog-" in done.stdout
    first = "first case that gates:\n    garl cases show scenarios/regressions/systems/lawn-"
    assert first in done.stdout
    assert "\n    garl film lawn-" in done.stdout
    assert "New cases that gate fail until they are fixed, committed, or accepted" in done.stdout
    add_cases_to_git(folder)
    return folder


@pytest.fixture
def searched(pytester: pytest.Pytester, searched_template: Path) -> pytest.Pytester:
    """Return a copy of the project with two saved cases."""
    shutil.copytree(searched_template, pytester.path, dirs_exist_ok=True)
    return pytester
