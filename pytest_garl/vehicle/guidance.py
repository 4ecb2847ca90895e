"""Targets of GUIDED and LAND: the setpoints and how they move the targets."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.vehicle.altitude import VerticalControl
from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.position import HorizontalControl
from pytest_garl.vehicle.rotations import Vector
from pytest_garl.vehicle.shaping import clamped

ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setpoint:
    """A setpoint of GUIDED as of ``time_s``; ``position_m`` is None for a velocity alone."""

    time_s: float
    position_m: Vector | None
    velocity_mps: Vector
    acceleration_mps2: Vector
    speed_mps: float

    def at(self, time_s: float, timeout_s: float) -> tuple[Vector | None, Vector, Vector]:
        """Return position, velocity and acceleration, moved on to a later time.

        After ``timeout_s`` without renewal the motion stops where it then is.
        """
        if self.velocity_mps is ZERO and self.acceleration_mps2 is ZERO:
            return self.position_m, ZERO, ZERO
        age = time_s - self.time_s
        over = age > timeout_s
        age = min(age, timeout_s)
        (vx, vy, vz), (ax, ay, az) = self.velocity_mps, self.acceleration_mps2
        place = self.position_m
        if place is not None:
            half = 0.5 * age * age
            place = (
                place[0] + vx * age + ax * half,
                place[1] + vy * age + ay * half,
                place[2] + vz * age + az * half,
            )
        if over:
            return place, ZERO, ZERO
        return place, (vx + ax * age, vy + ay * age, vz + az * age), self.acceleration_mps2


def follow(
    setpoint: Setpoint,
    time_s: float,
    horizontal: HorizontalControl,
    vertical: VerticalControl,
    parameters: ArduPilotParameters,
) -> None:
    """Move both targets one step towards a setpoint."""
    p = parameters
    place, (vx, vy, vz), (ax, ay, _) = setpoint.at(time_s, p.guid_timeout)
    down, up = -min(p.wpnav_speed_dn, setpoint.speed_mps), min(p.wpnav_speed_up, setpoint.speed_mps)
    top = min(p.wpnav_speed, setpoint.speed_mps)
    if place is None:
        size = (vx * vx + vy * vy) ** 0.5
        share = top / size if size > top else 1.0
        horizontal.target.at_velocity((vx * share, vy * share), (ax, ay))
        vertical.target.at_velocity(clamped(vz, down, up))
        return
    horizontal.target.towards((place[0], place[1]), (vx, vy), (ax, ay), top=top)
    vertical.target.towards(place[2], vz, down, up)
