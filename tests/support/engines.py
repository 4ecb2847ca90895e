"""A fixture that runs a test by each physics engine that is installed."""

from __future__ import annotations

import importlib.util
from typing import get_args

import pytest

from pytest_garl.engine import PACKAGES, VARIABLE, Engine

NEEDS_MUJOCO = pytest.mark.skipif(
    importlib.util.find_spec("mujoco") is None, reason="MuJoCo is not installed"
)


@pytest.fixture(params=get_args(Engine))
def engine(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Let the test's process, and those that it starts, fly by an engine; return its name."""
    name: Engine = request.param
    if importlib.util.find_spec(PACKAGES[name]) is None:
        pytest.skip(f"{PACKAGES[name]} is not installed")
    monkeypatch.setenv(VARIABLE, name)
    return name
