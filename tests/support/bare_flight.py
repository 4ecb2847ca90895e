"""Flights of a vehicle and a controller in an empty world, without a camera."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl import Airframe, VehicleState
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.simulation.physics.make_world import make_world
from pytest_garl.simulation.physics.vehicle import (
    FEET_FRICTION,
    Thrusts,
    drag,
    lag,
    vehicle_model,
    wrench,
)
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from pytest_garl.vehicle import ArduPilotControl, ArduPilotParameters

Orders = Callable[[float, Any], None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """A flight, one row per physics step: times (n,), the rest (n, 3) or (n, 4)."""

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]
    attitude: NDArray[np.float64]
    rates_radps: NDArray[np.float64]
    thrusts_n: NDArray[np.float64]
    target_m: NDArray[np.float64]
    modes: tuple[str, ...]

    def since(self, time_s: float) -> Trace:
        """Return the part from a time on, with that time as zero."""
        first = int(np.searchsorted(self.time_s, time_s))
        rows = {field.name: getattr(self, field.name)[first:] for field in fields(self)}
        return Trace(**(rows | {"time_s": rows["time_s"] - time_s}))

    @property
    def yaw_rad(self) -> NDArray[np.float64]:
        """Heading (n,), unwrapped."""
        x, y, z, w = self.attitude.T
        return np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def fly_bare(
    orders: Orders,
    duration_s: float,
    *,
    parameters: ArduPilotParameters | None = None,
    wind_mps: tuple[float, float] = (0.0, 0.0),
    wind_from_s: float = 0.0,
    control_rate_hz: float = PHYSICS_RATE_HZ,
    make: Callable[[Airframe], Any] | None = None,
    start_m: float = 0.0,
) -> Trace:
    """Fly from the ground at the origin; ``orders(time, controller)`` is called each step.

    ``make`` makes another controller, ``start_m`` begins in the air.

    The wind blows towards ``wind_mps`` from ``wind_from_s`` on.
    """
    airframe = Airframe(control_rate_hz=control_rate_hz)
    control: Any = make(airframe) if make else ArduPilotControl(airframe, parameters)
    model = vehicle_model(airframe)
    world = make_world(model, (0.0, 0.0, 0.0), [], [], FEET_FRICTION["concrete"])
    every = round(PHYSICS_RATE_HZ / control_rate_hz)
    if start_m:
        world.place_uav((0.0, 0.0, start_m), (0.0, 0.0, 0.0, 1.0))
    thrusts: Thrusts = (0.0, 0.0, 0.0, 0.0)
    wanted = thrusts
    rows: list[tuple[float, ...]] = []
    modes: list[str] = []
    try:
        for tick in range(round(duration_s * PHYSICS_RATE_HZ)):
            position, attitude, velocity, spin = world.uav_state()
            x, y, z, w = attitude
            rates = rotate((-x, -y, -z, w), spin)
            state = VehicleState(
                time_s=tick / PHYSICS_RATE_HZ,
                position_m=position,
                velocity_mps=velocity,
                attitude=attitude,
                angular_velocity_radps=rates,
                thrusts_n=thrusts,
            )
            if tick % every == 0:
                orders(state.time_s, control)
                wanted = control.control(state).newtons
            modes.append(control.mode)
            target = getattr(control, "target_position_m", position)
            rows.append((state.time_s, *position, *velocity, *attitude, *rates, *thrusts, *target))
            thrusts = lag(thrusts, wanted, model, 1 / PHYSICS_RATE_HZ)
            total, torque = wrench(thrusts, model)
            fx, fy, fz = rotate(attitude, (0.0, 0.0, total))
            wind = wind_mps if state.time_s >= wind_from_s else (0.0, 0.0)
            air = velocity[0] - wind[0], velocity[1] - wind[1], velocity[2]
            dx, dy, dz = drag(air, model)
            world.step(position, (fx + dx, fy + dy, fz + dz), rotate(attitude, torque))
    finally:
        world.close()
    table = np.array(rows)
    return Trace(
        time_s=table[:, 0],
        position_m=table[:, 1:4],
        velocity_mps=table[:, 4:7],
        attitude=table[:, 7:11],
        rates_radps=table[:, 11:14],
        thrusts_n=table[:, 14:18],
        target_m=table[:, 18:21],
        modes=tuple(modes),
    )
