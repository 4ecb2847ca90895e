"""The start of a flight: motors off on the ground, or hovering."""

from __future__ import annotations

import math

from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, GRAVITY_MPS2
from pytest_garl.landing_system import Command, VelocitySetpoint
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.physics.flight_control import NO_THRUST
from pytest_garl.simulation.physics.vehicle import Thrusts, VehicleModel
from pytest_garl.simulation.physics.world import World


def begin_at_start(
    world: World, model: VehicleModel, placed: Placed
) -> tuple[Thrusts, Command | None]:
    """Move the UAV to its start; return its thrusts, and the command until the system's first.

    A UAV that hovers is level and at rest, and wind moves it until its control has learned the
    wind.
    """
    yaw = math.radians(placed.scenario["heading.start_deg"])
    attitude = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    x, y, height = placed.start_m
    if placed.scenario.task.start.hovers:
        world.place_uav((x, y, height), attitude)
        each = model.mass_kg * GRAVITY_MPS2 / 4
        return (each, each, each, each), VelocitySetpoint(
            velocity_mps=(0.0, 0.0, 0.0), yaw_rad=None
        )
    if yaw:
        world.place_uav((x, y, BODY_ABOVE_FEET_M), attitude)
    return NO_THRUST, None
