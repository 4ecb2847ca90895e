"""Target position and descent of LAND."""

from __future__ import annotations

import math

from pytest_garl.landing_system import VehicleState
from pytest_garl.vehicle.altitude import VerticalControl
from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.position import HorizontalControl
from pytest_garl.vehicle.precision_landing import PrecisionLanding
from pytest_garl.vehicle.rotations import Vector
from pytest_garl.vehicle.shaping import Pair
from pytest_garl.vehicle.sink_rate import (
    descent_rate,
    descent_rate_over_target,
)


class LandMode:
    """Comes down over one place; with ``PLND_ENABLED`` over the target that is measured."""

    def __init__(self, parameters: ArduPilotParameters) -> None:
        self._parameters = parameters
        self.precision = PrecisionLanding(parameters)
        self._place: Pair = (0.0, 0.0)

    def begin(self, place: Pair) -> None:
        """Land at ``place``, or on the target if one is known."""
        self._place = place
        self.precision.begin()

    def measure(self, target_m: Vector, time_s: float, state: VehicleState) -> None:
        """Take a measurement of the target's place in the world, as of ``time_s``."""
        wx, wy, wz = state.angular_velocity_radps
        self.precision.target.measure(
            (target_m[0], target_m[1]),
            time_s,
            state.position_m[2] - target_m[2],
            math.sqrt(wx * wx + wy * wy + wz * wz),
        )

    def aim(
        self,
        state: VehicleState,
        height_m: float,
        horizontal: HorizontalControl,
        vertical: VerticalControl,
        *,
        maybe_landed: bool,
    ) -> None:
        """Move the targets of the position loops for one step."""
        p = self._parameters
        x, y, _ = state.position_m
        rate = descent_rate(height_m, p)
        order = None
        if p.plnd_enabled:
            order = self.precision.update(state.time_s, state.position_m, height_m)
        if order is not None and order.goal_m is not None:
            self._place = order.goal_m[:2]
            vertical.target.towards(order.goal_m[2], 0.0, -p.wpnav_speed_dn, p.wpnav_speed_up)
        else:
            if order is not None and order.target_m is not None:
                self._place = order.target_m
                error = math.dist(order.target_m, (x, y))
                rate = descent_rate_over_target(rate, height_m, error, p)
            elif order is not None and order.action == "hold":
                rate = 0.0
            vertical.target.at_velocity(rate)
        if maybe_landed:
            horizontal.relax((x, y), (state.velocity_mps[0], state.velocity_mps[1]))
        else:
            horizontal.target.towards(self._place, top=p.wpnav_speed)
