"""pytest-garl finds the ways in which a marker-based UAV landing system fails.

The names below are all that a landing system and its tests need.  They are loaded when
first used, because every pytest run imports this package.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pytest_garl.fixtures import Landing
    from pytest_garl.landing_system import (
        Abort,
        Airframe,
        AttitudeSetpoint,
        Camera,
        Command,
        Detection,
        Diagnostics,
        Land,
        LandingSystem,
        Mission,
        MotorThrusts,
        Observation,
        PositionSetpoint,
        VehicleState,
        VelocitySetpoint,
    )
    from pytest_garl.verdicts.verdict import Limits as limits  # noqa: N813 (a verb in a marker)

__version__ = "0.1.0"

__all__ = [
    "Abort",
    "Airframe",
    "AttitudeSetpoint",
    "Camera",
    "Command",
    "Detection",
    "Diagnostics",
    "Land",
    "Landing",
    "LandingSystem",
    "Mission",
    "MotorThrusts",
    "Observation",
    "PositionSetpoint",
    "VehicleState",
    "VelocitySetpoint",
    "limits",
]


def __getattr__(name: str) -> object:
    if name == "limits":
        from pytest_garl.verdicts.verdict import Limits

        return Limits
    if name == "Landing":
        # What flies must not depend on pytest, and an import here would say that it does.
        found: object = importlib.import_module("pytest_garl.fixtures").Landing
        return found
    if name in __all__:
        from pytest_garl import landing_system

        return getattr(landing_system, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
