"""What is wrong with a value that a landing system returned."""

from __future__ import annotations

import dataclasses
import math

from pytest_garl.landing_system import (
    Abort,
    AttitudeSetpoint,
    Diagnostics,
    Land,
    MotorThrusts,
    PositionSetpoint,
    VelocitySetpoint,
)

COMMANDS = (PositionSetpoint, VelocitySetpoint, AttitudeSetpoint, Land, Abort)
_LENGTHS = {"position_m": 3, "velocity_mps": 3, "attitude": 4}


def problem_with_command(command: object) -> str | None:
    """Say what is wrong with the answer of ``step``, or None."""
    if not isinstance(command, COMMANDS):
        names = ", ".join(kind.__name__ for kind in COMMANDS)
        return f"step returned {_short(command)}; expected one of {names}"
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        if field.name == "diagnostics":
            if value is not None and not isinstance(value, Diagnostics):
                return (
                    f"{type(command).__name__}.diagnostics is {_short(value)}; expected Diagnostics"
                )
            continue
        count = _LENGTHS.get(field.name)
        found = _problem(value, count)
        if found:
            return f"step returned {type(command).__name__} with {field.name} {found}"
    return None


def problem_with_thrusts(thrusts: object) -> str | None:
    """Say what is wrong with the answer of ``control``, or None."""
    if isinstance(thrusts, MotorThrusts) and _are_four_floats(thrusts.newtons):
        return None
    if not isinstance(thrusts, MotorThrusts):
        return f"control returned {_short(thrusts)}; expected MotorThrusts"
    found = _problem(thrusts.newtons, 4)
    return f"control returned MotorThrusts with newtons {found}" if found else None


def _are_four_floats(values: object) -> bool:
    """Whether values are a tuple of four finite floats: the usual case, 240 times a second."""
    if type(values) is not tuple or len(values) != 4:
        return False
    a, b, c, d = values
    return type(a) is type(b) is type(c) is type(d) is float and math.isfinite(a + b + c + d)


def _problem(value: object, count: int | None) -> str | None:
    if count is None:
        return None if _finite(value) else f"= {_short(value)}; expected a finite number"
    try:
        items = list(value)  # type: ignore[call-overload]  # any sequence of numbers will do
    except TypeError:
        return f"= {_short(value)}; expected {count} finite numbers"
    if len(items) != count or not all(_finite(item) for item in items):
        return f"= {_short(value)}; expected {count} finite numbers"
    return None


def _finite(value: object) -> bool:
    try:
        return math.isfinite(value)  # type: ignore[arg-type]  # that is the question
    except TypeError:
        return False


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
