"""The land detector: when the motors stop on the ground, for the rest of the flight."""

from __future__ import annotations

from pytest_garl.flight.thresholds import GRAVITY_MPS2
from pytest_garl.simulation.physics.vehicle import VehicleModel

DETECTED_AFTER_S = 1.0
"""PX4's three states of landing take 0.35, 0.25 and 0.3 s; ArduPilot documents 1 s for all its
conditions."""
LOW_THRUST_OF_HOVER = 0.3
"""PX4's documented threshold of ground contact: MPC_THR_MIN + 0.3 (MPC_THR_HOVER - MPC_THR_MIN);
the motors here have no minimum.  A UAV that hovers while its feet touch the ground has about 1."""
OFF_OF_MAXIMUM = 0.05
"""Less thrust than this share of the maximum is as good as none: a hover needs 28 %."""
STEADY_MPS = 0.2
"""A faster climb or descent is no rest; PX4's LNDMC_Z_VEL_MAX has a default of 0.25 m/s."""


class LandDetector:
    """Says when the motors stop: after a second of low thrust on the ground without a climb.

    The command makes no difference, and the horizontal speed neither.  Switched-off motors stop for
    good after a second, whatever the vertical speed.
    """

    def __init__(self, model: VehicleModel) -> None:
        self._low_n = LOW_THRUST_OF_HOVER * model.mass_kg * GRAVITY_MPS2
        self._off_n = OFF_OF_MAXIMUM * 4 * model.max_thrust_n
        self._low_since_s: float | None = None
        self._off_since_s: float | None = None

    def lands(self, time_s: float, on_ground: bool, thrust_n: float, climb_mps: float) -> bool:
        """Take one step of the physics; return whether the motors stop."""
        low = on_ground and thrust_n < self._low_n and abs(climb_mps) < STEADY_MPS
        off = on_ground and thrust_n < self._off_n
        self._low_since_s = _begin(self._low_since_s, low, time_s)
        self._off_since_s = _begin(self._off_since_s, off, time_s)
        return any(
            since_s is not None and time_s - since_s >= DETECTED_AFTER_S
            for since_s in (self._low_since_s, self._off_since_s)
        )


def _begin(since_s: float | None, holds: bool, time_s: float) -> float | None:
    if not holds:
        return None
    return time_s if since_s is None else since_s
