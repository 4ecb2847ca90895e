"""Which physics engine flies, and what a project is told if it is not there."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from pytest_garl import engine
from pytest_garl.errors import EngineError


@pytest.fixture(autouse=True)
def asked_anew(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.delenv(engine.VARIABLE, raising=False)
    engine._resolved.cache_clear()
    yield
    engine._resolved.cache_clear()


def installed(monkeypatch: pytest.MonkeyPatch, *modules: str) -> None:
    """Let these modules be installed, and no other engine."""

    def find_spec(name: str) -> object:
        return SimpleNamespace() if name in modules else None

    monkeypatch.setattr(importlib.util, "find_spec", find_spec)


@pytest.mark.parametrize(
    ("modules", "choice", "found"),
    [
        (("pybullet", "mujoco"), "", "bullet"),
        (("pybullet", "mujoco"), "auto", "bullet"),
        (("pybullet", "mujoco"), "mujoco", "mujoco"),
        (("mujoco",), "auto", "mujoco"),
        (("mujoco",), "mujoco", "mujoco"),
        (("pybullet",), "bullet", "bullet"),
    ],
)
def test_bullet_flies_unless_it_is_missing_or_mujoco_is_asked_for(
    modules: tuple[str, ...], choice: str, found: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed(monkeypatch, *modules)
    monkeypatch.setenv(engine.VARIABLE, choice)
    assert engine.chosen() == found


@pytest.mark.parametrize(
    ("modules", "choice", "told"),
    [
        (("pybullet",), "mujoco", r"found mujoco, which is not installed here: pip install"),
        (("mujoco",), "bullet", r"found bullet, which is not installed here: install pybullet"),
        ((), "auto", r"no physics engine is installed"),
        (("pybullet",), "unity", r"found 'unity', expected one of auto, bullet, mujoco"),
    ],
)
def test_an_engine_that_cannot_fly_is_refused(
    modules: tuple[str, ...], choice: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed(monkeypatch, *modules)
    monkeypatch.setenv(engine.VARIABLE, choice)
    with pytest.raises(EngineError, match=told):
        engine.chosen()


def test_versions_tell_the_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("bullet", "mujoco"):
        installed(monkeypatch, "pybullet", "mujoco")
        monkeypatch.setenv(engine.VARIABLE, name)
        assert engine.engine_of(tuple((each, "1") for each in engine.packages())) == name
    assert engine.engine_of(()) is None
