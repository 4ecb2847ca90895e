"""Rate control: wanted body rates to the mixer's roll, pitch and yaw in [-1, 1]."""

from __future__ import annotations

from pytest_garl.vehicle.mixer import MotorLimits
from pytest_garl.vehicle.parameters import ArduPilotParameters, RatePid
from pytest_garl.vehicle.pid import Pid
from pytest_garl.vehicle.rotations import Vector
from pytest_garl.vehicle.shaping import clamped


class RateControl:
    """One PID per axis."""

    def __init__(self, parameters: ArduPilotParameters, dt_s: float) -> None:
        self._roll, self._pitch, self._yaw = (
            _pid(item, dt_s)
            for item in (parameters.atc_rat_rll, parameters.atc_rat_pit, parameters.atc_rat_yaw)
        )

    def reset(self) -> None:
        """Forget the past."""
        for item in (self._roll, self._pitch, self._yaw):
            item.reset()

    def outputs(self, wanted: Vector, measured: Vector, limits: MotorLimits) -> Vector:
        """Return roll, pitch and yaw; ``limits`` are those of the last mix."""
        roll = self._roll.update(wanted[0], measured[0], limits.tilt)
        pitch = self._pitch.update(wanted[1], measured[1], limits.tilt)
        yaw = self._yaw.update(wanted[2], measured[2], limits.yaw)
        return clamped(roll, -1.0, 1.0), clamped(pitch, -1.0, 1.0), clamped(yaw, -1.0, 1.0)


def _pid(item: RatePid, dt_s: float) -> Pid:
    return Pid(
        item.p,
        item.i,
        item.d,
        item.imax,
        fltt=item.fltt,
        flte=item.flte,
        fltd=item.fltd,
        dt_s=dt_s,
    )
