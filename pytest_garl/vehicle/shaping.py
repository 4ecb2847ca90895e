"""Target shaping: how fast an error may be closed with bounded acceleration and jerk."""

from __future__ import annotations

import math
from collections.abc import Callable

Pair = tuple[float, float]
Rate = Callable[[float], float]

SLOWER = 1 / 3
"""Gain of the shaping's outer loop over that of its inner one: their poles have a damping of
1 / (2 sqrt(1/3)) = 0.87 and overshoot by 0.4 %."""
SOFTER = 0.5
"""Share of the acceleration with which the outer loop plans to brake; the jerk needs the rest."""


def clamped(value: float, low: float, high: float) -> float:
    """Return ``value`` within [low, high]."""
    return low if value < low else high if value > high else value


def sqrt_controller(p: float, limit: float) -> Rate:
    """Return the function from an error to the rate at which to close it.

    Up to an error of ``limit / p²`` the rate is ``p * error``; beyond it is the rate from which
    a constant deceleration ``limit`` still ends at zero, sqrt(2 limit (error - limit / (2 p²))).
    ``p`` must be below the rate of the steps in Hz, else a step passes the goal.
    """
    linear = limit / (p * p)
    half, double = linear / 2, 2 * limit

    def rate(error: float) -> float:
        size = -error if error < 0 else error
        value = p * size if size <= linear else math.sqrt(double * (size - half))
        return value if error > 0 else -value

    return rate


def stopping_distance(speed: float, p: float, limit: float) -> float:
    """Return the error (m) at which :func:`sqrt_controller` asks for ``speed`` (m/s)."""
    if speed <= limit / p:
        return speed / p
    return limit / (2 * p * p) + speed * speed / (2 * limit)


class ShapedAxis:
    """A target on one axis that moves with bounded speed, acceleration and jerk; m and s.

    Nested square-root controllers: velocity to acceleration with the jerk, and position to
    velocity slower and softer than that, so that the loop inside can follow.
    """

    def __init__(self, acceleration_max: float, jerk: float, dt_s: float) -> None:
        self._acceleration_max, self._jerk, self._dt = acceleration_max, jerk, dt_s
        self._rate = sqrt_controller(SLOWER * jerk / acceleration_max, SOFTER * acceleration_max)
        self._pull = sqrt_controller(jerk / acceleration_max, jerk)
        self.reset(0.0)

    def reset(self, position: float, velocity: float = 0.0) -> None:
        """Put the target somewhere, unaccelerated."""
        self.position, self.velocity, self.acceleration = position, velocity, 0.0

    def towards(self, goal: float, feed_forward: float, down: float, up: float) -> None:
        """Advance one step towards a goal that moves at ``feed_forward``; down <= v <= up."""
        rate = self._rate(goal - self.position)
        self.at_velocity(clamped(rate + feed_forward, down, up))

    def at_velocity(self, velocity: float) -> None:
        """Advance one step towards a velocity."""
        top, dt = self._acceleration_max, self._dt
        wanted = clamped(self._pull(velocity - self.velocity), -top, top)
        change = self._jerk * dt
        acceleration = clamped(wanted, self.acceleration - change, self.acceleration + change)
        self.acceleration = acceleration
        self.position += self.velocity * dt + 0.5 * acceleration * dt * dt
        self.velocity += acceleration * dt


class ShapedPlane:
    """The same in the horizontal plane (m, s), on lengths, so that a diagonal is no faster."""

    def __init__(self, acceleration_max: float, jerk: float, dt_s: float) -> None:
        self._acceleration_max, self._jerk, self._dt = acceleration_max, jerk, dt_s
        self._rate = sqrt_controller(SLOWER * jerk / acceleration_max, SOFTER * acceleration_max)
        self._pull = sqrt_controller(jerk / acceleration_max, jerk)
        self.reset((0.0, 0.0))

    def reset(self, position: Pair, velocity: Pair = (0.0, 0.0)) -> None:
        """Put the target somewhere, unaccelerated."""
        self.position, self.velocity, self.acceleration = position, velocity, (0.0, 0.0)

    def stopping_point(self) -> Pair:
        """Return the nearest goal at which the target stops without turning back."""
        (x, y), (vx, vy) = self.position, self.velocity
        speed = math.sqrt(vx * vx + vy * vy)
        if speed == 0:
            return x, y
        top = self._acceleration_max
        far = stopping_distance(speed, SLOWER * self._jerk / top, SOFTER * top) / speed
        return x + vx * far, y + vy * far

    def towards(
        self,
        goal: Pair,
        velocity: Pair = (0.0, 0.0),
        acceleration: Pair = (0.0, 0.0),
        *,
        top: float,
    ) -> None:
        """Advance one step towards a goal that moves; no faster than ``top``."""
        ex, ey = goal[0] - self.position[0], goal[1] - self.position[1]
        error = math.sqrt(ex * ex + ey * ey)
        vx, vy = velocity
        if error > 0:
            share = self._rate(error) / error
            vx, vy = vx + share * ex, vy + share * ey
        speed = math.sqrt(vx * vx + vy * vy)
        if speed > top:
            vx, vy = vx * top / speed, vy * top / speed
        self.at_velocity((vx, vy), acceleration)

    def at_velocity(self, velocity: Pair, feed_forward: Pair = (0.0, 0.0)) -> None:
        """Advance one step towards a velocity that changes at ``feed_forward``."""
        dt, (vx, vy), (ax, ay) = self._dt, self.velocity, self.acceleration
        ex, ey = velocity[0] - vx, velocity[1] - vy
        error = math.sqrt(ex * ex + ey * ey)
        wx, wy = feed_forward
        if error > 0:
            share = self._pull(error) / error
            wx, wy = wx + share * ex, wy + share * ey
        size = math.sqrt(wx * wx + wy * wy)
        if size > self._acceleration_max:
            wx, wy = wx * self._acceleration_max / size, wy * self._acceleration_max / size
        dx, dy = wx - ax, wy - ay
        size, change = math.sqrt(dx * dx + dy * dy), self._jerk * dt
        if size > change:
            dx, dy = dx * change / size, dy * change / size
        ax, ay = ax + dx, ay + dy
        x, y = self.position
        self.position = x + vx * dt + 0.5 * ax * dt * dt, y + vy * dt + 0.5 * ay * dt * dt
        self.velocity, self.acceleration = (vx + ax * dt, vy + ay * dt), (ax, ay)
