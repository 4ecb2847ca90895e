"""What the UAV's navigation says of its state, which the landing system and the control act on.

The errors are first-order Gauss-Markov processes.  Such a process has no derivative, so the error
follows it with a lag and a largest rate, and the error of the velocity is exactly that rate: the
estimated velocity is the derivative of the estimated position.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.events import Beginning, Moments
from pytest_garl.simulation.physics.vehicle import Motion, Quaternion, Vector
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from pytest_garl.simulation.randomness import generator

LAG_S = 10.0
"""Engineering estimate: filters such as PX4's EKF2 weight GPS so that they follow it in some 10
s."""
MOST_RATE_MPS = 0.1
TICKS_PER_DRAW = 24
"""Ten draws a second: often, compared with the lag."""
_DRAW_S = TICKS_PER_DRAW / PHYSICS_RATE_HZ
_TICK_S = 1 / PHYSICS_RATE_HZ


@dataclass(slots=True, kw_only=True)
class _Wandering:
    """Errors that follow a Gauss-Markov process; lists have one entry per component."""

    error: list[float]
    sigma: float
    most_rate: float = math.inf
    rate: list[float] = field(default_factory=list)
    target: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.target, self.rate = [*self.error], [0.0] * len(self.error)

    def draw(self, keep: float, numbers: list[float]) -> None:
        """Draw the next target, ``keep`` is the correlation with the last one; turn towards it."""
        spread = self.sigma * math.sqrt(1 - keep * keep)
        self.target = [
            keep * old + spread * number for old, number in zip(self.target, numbers, strict=True)
        ]
        rate = [(wanted - now) / LAG_S for wanted, now in zip(self.target, self.error, strict=True)]
        fast = math.hypot(*rate) / self.most_rate
        self.rate = [each / fast for each in rate] if fast > 1 else rate

    def advance(self) -> None:
        """Change the errors for a step of the physics."""
        for index, rate in enumerate(self.rate):
            self.error[index] += rate * _TICK_S


def error_m_at(scenario: Scenario, time_s: float, moments: Moments) -> Vector:
    """Return the error of the estimated position at a time of a scenario's flight."""
    navigation = Navigation(scenario, moments)
    rest = Motion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    for tick in range(round(time_s * PHYSICS_RATE_HZ) + 1):
        navigation.estimate(tick, rest)
    return navigation.error_m


class Navigation:
    """The estimate of the UAV's motion; call ``estimate`` for each step of the physics."""

    def __init__(self, scenario: Scenario, moments: Moments) -> None:
        def value(name: str) -> float:
            return scenario[f"navigation.{name}"]

        away = math.radians(value("towards_deg"))
        # What follows with a lag has less variance than its target, so the target gets more.
        more = math.sqrt(1 + LAG_S / value("correlation_s"))
        position_m = value("position_m")
        self._place = _Wandering(
            error=[position_m * math.cos(away), position_m * math.sin(away)],
            sigma=more * position_m / math.sqrt(2),
            most_rate=MOST_RATE_MPS,
        )
        height_m = value("height_m")
        self._height = _Wandering(error=[0.0], sigma=more * height_m, most_rate=MOST_RATE_MPS)
        yaw = math.radians(value("yaw_deg"))
        self._yaw = _Wandering(error=[yaw], sigma=more * abs(yaw))
        tilt, side = math.radians(value("tilt_deg")), math.radians(value("tilt_towards_deg"))
        # About the body's x (right side down) and y (nose down).
        self._tilt = _Wandering(
            error=[tilt * math.sin(side), tilt * math.cos(side)], sigma=more * tilt / math.sqrt(2)
        )
        self._keep = math.exp(-_DRAW_S / value("correlation_s"))
        # With the slices of the drawn numbers that are theirs.
        parts = (self._place, 0, 2), (self._height, 2, 3), (self._yaw, 3, 4), (self._tilt, 4, 6)
        self._parts = [part for part in parts if part[0].sigma]
        self._errs = bool(self._parts)
        jump, over = scenario["jump.distance_m"], math.radians(scenario["jump.towards_deg"])
        self._jump_m = jump * math.cos(over), jump * math.sin(over)
        self._jumps = Beginning(scenario, "jump", moments)
        self._jumped = False
        self._rng = generator(scenario.seed, "navigation")

    @property
    def error_m(self) -> Vector:
        """The error of the estimated position at this moment."""
        (x, y), (z,) = self._place.error, self._height.error
        jump_x, jump_y = self._jump_m if self._jumped else (0.0, 0.0)
        return x + jump_x, y + jump_y, z

    def estimate(self, tick: int, motion: Motion) -> Motion:
        """Return the estimate of a motion, itself if nothing errs."""
        if not self._jumped and any(self._jump_m):
            begins_s = self._jumps.time_s
            self._jumped = math.isfinite(begins_s) and tick >= round(begins_s * PHYSICS_RATE_HZ)
        if not self._errs and not self._jumped:
            return motion
        if self._errs and tick:
            self._advance(tick)
        position = _sum(motion.position_m, self.error_m)
        velocity = _sum(motion.velocity_mps, (*self._place.rate, *self._height.rate))
        attitude = motion.attitude
        if any(self._yaw.error) or any(self._tilt.error):
            yaw, (about_x, about_y) = self._yaw.error[0], self._tilt.error
            attitude = _product(_turn(0.0, 0.0, yaw), attitude)
            attitude = _product(attitude, _turn(about_x, about_y, 0.0))
        return Motion(position, velocity, attitude, motion.spin_radps)

    def _advance(self, tick: int) -> None:
        if tick % TICKS_PER_DRAW == 0:
            # As many draws for each part whatever errs, so that one error does not change another.
            numbers = [float(each) for each in self._rng.standard_normal(6)]
            for part, first, last in self._parts:
                part.draw(self._keep, numbers[first:last])
        for part, _, _ in self._parts:
            part.advance()


def _sum(one: Vector, other: tuple[float, ...]) -> Vector:
    (x, y, z), (dx, dy, dz) = one, other
    return x + dx, y + dy, z + dz


def _turn(x: float, y: float, z: float) -> Quaternion:
    """Return the quaternion of a turn about an axis by the vector's length, in rad."""
    angle = math.hypot(x, y, z)
    share = math.sin(angle / 2) / angle if angle else 0.5
    return x * share, y * share, z * share, math.cos(angle / 2)


def _product(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the turn ``second`` followed by ``first``, both seen in the frame of ``first``."""
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
