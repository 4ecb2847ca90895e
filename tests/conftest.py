"""What all tests that run pytest in processes of their own share."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator

import pytest
from hypothesis import settings

from tests.support.other_plugins import FASTER
from tests.support.warm_python import WarmPopen

# A machine with other work is slow: no test asserts how long an example takes.
settings.register_profile("without deadlines", deadline=None)
settings.load_profile("without deadlines")


@pytest.fixture(scope="session", autouse=True)
def faster_runs() -> Iterator[None]:
    """Let runs of pytest in other processes start without other plugins, and warm."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTEST_ADDOPTS", FASTER)
        patch.setattr(WarmPopen, "environment", dict(os.environ))
        patch.setattr(subprocess, "Popen", WarmPopen)
        yield


@pytest.fixture(autouse=True)
def faster_runs_of_pytester(request: pytest.FixtureRequest) -> None:
    """Do so for ``pytester``, too, which drops the options of the environment."""
    if "pytester" in request.fixturenames:
        patch: pytest.MonkeyPatch = request.getfixturevalue("monkeypatch")
        request.getfixturevalue("pytester")
        patch.setenv("PYTEST_ADDOPTS", FASTER)
