"""The mixer of a quadrotor in X: roll, pitch, yaw and throttle to four shares of full thrust.

Where not all fits into the motors' range, roll and pitch come first, then yaw, which always
keeps ``MOT_YAW_HEADROOM``, then the throttle.  Motors: front left, front right, rear right,
rear left; positive roll lifts the left, positive pitch the rear (the nose goes down), positive
yaw turns counter-clockwise from above.
"""

from __future__ import annotations

from typing import NamedTuple

Shares = tuple[float, float, float, float]


class MotorLimits(NamedTuple):
    """The limits that a mix has reached; the integrators use them."""

    tilt: bool = False
    yaw: bool = False
    lower: bool = False
    upper: bool = False


FREE = MotorLimits()


def mixed(
    roll: float,
    pitch: float,
    yaw: float,
    throttle: float,
    *,
    average_max: float,
    yaw_headroom: float,
    top: float = 1.0,
) -> tuple[Shares, MotorLimits]:
    """Return the motors' shares of full thrust and what had to be cut.

    A command of 1 on an axis moves every motor by half its range.  ``throttle`` is the wanted
    mean; for attitude's sake it may be raised to ``average_max``, and lowered.  ``top`` is the
    greatest throttle, less than 1 while the motors spool up.
    """
    lower, upper = throttle <= 0.0, throttle >= top
    throttle = 0.0 if lower else min(throttle, top)
    average_max = max(throttle, min(average_max, top))
    base = min(0.5 * top, average_max)
    a, b = 0.5 * (roll - pitch), 0.5 * (roll + pitch)
    # Front left a, front right -b, rear right -a, rear left b; yaw turns with the diagonal of
    # front right and rear left and against the other.
    spread_a, spread_b = abs(a), abs(b)
    if yaw >= 0:
        room = min(1 - base - spread_b, base - spread_a)
    else:
        room = min(1 - base - spread_a, base - spread_b)
    room = max(2 * room, yaw_headroom)
    cut_yaw = abs(yaw) > room
    if cut_yaw:
        yaw = room if yaw > 0 else -room
    turn = 0.5 * yaw
    fl, fr, rr, rl = a - turn, turn - b, -a - turn, b + turn
    low, high = min(fl, fr, rr, rl), max(fl, fr, rr, rl)
    scale = 1.0
    if high - low > 1.0:
        scale = 1.0 / (high - low)
    if low < 0 and average_max + low * scale < 0:
        scale = -average_max / low
    cut_tilt = scale < 1.0
    level = throttle
    if level + low * scale < 0:
        level = -low * scale
    elif level + high * scale > 1:
        level = 1 - high * scale
        upper = True
    shares = level + fl * scale, level + fr * scale, level + rr * scale, level + rl * scale
    return shares, MotorLimits(cut_tilt, cut_yaw or cut_tilt, lower, upper)
