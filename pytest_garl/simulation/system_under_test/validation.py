"""Commands as the simulator takes them: plain values, or an error that says what is wrong."""

from __future__ import annotations

import inspect
import math
from typing import Any

from pytest_garl.commands import (
    LEAST_ASKED_ACCELERATION_MPS2,
    LEAST_ASKED_TILT_RAD,
    MAX_SPEED_MPS,
    MOST_ASKED_ACCELERATION_MPS2,
    MOST_ASKED_TILT_RAD,
    WORLD_M,
    Abort,
    AttitudeSetpoint,
    Command,
    Land,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.foreign_text import shown_foreign
from pytest_garl.landing_system import MotorThrusts
from pytest_garl.simulation.system_under_test.diagnostics import DiagnosticsQuota, read_diagnostics
from pytest_garl.simulation.system_under_test.reading import NonsenseError, number, numbers, vector

COMMANDS = (PositionSetpoint, VelocitySetpoint, AttitudeSetpoint, Land, Abort)
QUATERNION_SLACK = 0.1
"""Largest deviation of a quaternion's length from 1: rounding in float16 stays far below."""
MAX_THRUST_FACTOR = 10.0
"""A mixer may ask a saturated motor for more than there is, and for less than nothing; ten times
what it has is no mixer's answer."""

_Thrusts = tuple[float, float, float, float]


def read_command(answer: Any, quota: DiagnosticsQuota) -> Command:
    """Return the answer of ``step`` rebuilt from plain floats, or raise NonsenseError.

    Each field is read once, so what comes back later is what was checked.  ``quota`` is what the
    flight's record still takes of diagnostics.
    """
    kind = next((kind for kind in COMMANDS if isinstance(answer, kind)), None)
    if inspect.iscoroutine(answer):
        answer.close()  # Python would warn that nobody awaited it.
        raise NonsenseError(
            "step is `async def`: it returned a coroutine, which nobody awaits; expected a plain "
            "`def` that returns a command"
        )
    if kind is None:
        names = ", ".join(kind.__name__ for kind in COMMANDS)
        raise NonsenseError(f"step returned {shown_foreign(answer)}; expected one of {names}")
    at = f"step returned {kind.__name__} with "
    diagnostics = read_diagnostics(answer.diagnostics, f"{at}diagnostics")
    if diagnostics is not None:
        diagnostics = quota.shorten(diagnostics, f"{at}diagnostics")
    if kind is Abort:
        return Abort(diagnostics=diagnostics)
    if kind is Land:
        return Land(speed_mps=_speed(answer, at), diagnostics=diagnostics)
    if kind is AttitudeSetpoint:
        return AttitudeSetpoint(
            attitude=_quaternion(answer.attitude, f"{at}attitude"),
            thrust=number(answer.thrust, f"{at}thrust", 0.0, 1.0, "of the maximum"),
            diagnostics=diagnostics,
        )
    if kind is VelocitySetpoint:
        return VelocitySetpoint(
            velocity_mps=vector(answer.velocity_mps, f"{at}velocity_mps", MAX_SPEED_MPS, "m/s"),
            yaw_rad=_optional(answer.yaw_rad, f"{at}yaw_rad"),
            diagnostics=diagnostics,
        )
    return PositionSetpoint(
        position_m=vector(answer.position_m, f"{at}position_m", WORLD_M, "m"),
        speed_mps=_speed(answer, at),
        yaw_rad=_optional(answer.yaw_rad, f"{at}yaw_rad"),
        acceleration_mps2=_optional(
            answer.acceleration_mps2,
            f"{at}acceleration_mps2",
            LEAST_ASKED_ACCELERATION_MPS2,
            MOST_ASKED_ACCELERATION_MPS2,
            "m/s²",
        ),
        tilt_rad=_optional(
            answer.tilt_rad, f"{at}tilt_rad", LEAST_ASKED_TILT_RAD, MOST_ASKED_TILT_RAD, "rad"
        ),
        diagnostics=diagnostics,
    )


def read_thrusts(answer: Any, max_thrust_n: float) -> _Thrusts:
    """Return the answer of ``control`` as plain floats, or raise NonsenseError."""
    if not isinstance(answer, MotorThrusts):
        raise NonsenseError(f"control returned {shown_foreign(answer)}; expected MotorThrusts")
    values, most = answer.newtons, MAX_THRUST_FACTOR * max_thrust_n
    # The usual case, 240 times a second; what is not finite fails the comparison.
    if (
        type(values) is tuple
        and len(values) == 4
        and all(type(each) is float and -most <= each <= most for each in values)
    ):
        return values
    a, b, c, d = numbers(values, "control returned MotorThrusts with newtons", 4, most, "N")
    return a, b, c, d


def _optional(
    value: object, field: str, low: float = -math.inf, high: float = math.inf, unit: str = ""
) -> float | None:
    return None if value is None else number(value, field, low, high, unit)


def _speed(answer: Any, at: str) -> float:
    value = answer.speed_mps
    found = number(value, f"{at}speed_mps", 0.0, MAX_SPEED_MPS, "m/s")
    if found == 0:
        raise NonsenseError(f"{at}speed_mps = {shown_foreign(value)}; expected more than 0 m/s")
    return found


def _quaternion(value: object, field: str) -> tuple[float, float, float, float]:
    x, y, z, w = numbers(value, field, 4)
    length = math.hypot(x, y, z, w)
    if not abs(length - 1) <= QUATERNION_SLACK:
        raise NonsenseError(
            f"{field} = {shown_foreign((x, y, z, w))}, of length {length:.3g}; "
            "expected a unit quaternion x, y, z, w"
        )
    return x / length, y / length, z / length, w / length
