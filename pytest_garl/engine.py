"""Which physics engine flies: Bullet, or MuJoCo where Bullet has no wheel.

A project chooses it once, by the ini key ``garl_engine``.  The choice stands in the environment, so
that all processes that this one starts fly by it; a job names it too, for those elsewhere.
"""

from __future__ import annotations

import functools
import importlib.util
import os
from collections.abc import Mapping
from typing import Literal, get_args

from pytest_garl.errors import EngineError

Engine = Literal["bullet", "mujoco"]
CHOICES = ("auto", *get_args(Engine))
"""Values of the ini key; "auto" is Bullet if it is installed, else MuJoCo."""
VARIABLE = "GARL_ENGINE"
PACKAGES: Mapping[Engine, str] = {"bullet": "pybullet", "mujoco": "mujoco"}
"""The module of each engine, and what versions call it."""
TITLES: Mapping[Engine, str] = {"bullet": "Bullet", "mujoco": "MuJoCo"}
_MISSING = {
    "bullet": "bullet, which is not installed here: install pybullet or, if that has no wheel for "
    "this Python and machine, pybullet-arm64; or set garl_engine = mujoco",
    "mujoco": "mujoco, which is not installed here: pip install 'pytest-garl[mujoco]'; or set "
    "garl_engine = auto",
}


def prefer(choice: str) -> None:
    """Let this process, and all that it starts from now on, fly by an engine, or by "auto"."""
    os.environ[VARIABLE] = choice


def chosen() -> Engine:
    """Return the engine by which this process flies; raise EngineError if it cannot."""
    return _resolved(os.environ.get(VARIABLE) or "auto")


def packages(engine: Engine | None = None) -> tuple[str, ...]:
    """Return the packages whose versions determine the bytes of a flight by an engine.

    None stands for the engine of this process.
    """
    return ("pytest-garl", "numpy", "opencv-python-headless", PACKAGES[engine or chosen()])


def engine_of(versions: tuple[tuple[str, str], ...]) -> Engine | None:
    """Return the engine among the packages that flew; None for simulators that record none."""
    names = {name for name, _ in versions}
    return next((engine for engine, package in PACKAGES.items() if package in names), None)


@functools.cache
def _resolved(choice: str) -> Engine:
    if choice not in CHOICES:
        raise EngineError(f"garl_engine: found {choice!r}, expected one of {', '.join(CHOICES)}")
    there: list[Engine] = [
        each for each in get_args(Engine) if importlib.util.find_spec(PACKAGES[each])
    ]
    if not there:
        raise EngineError(
            "no physics engine is installed: pip install pytest-garl brings the one that has a "
            "wheel for this Python and machine"
        )
    if choice == "auto":
        return there[0]
    if choice not in there:
        raise EngineError(f"garl_engine: found {_MISSING[choice]}")
    return there[there.index(choice)]
