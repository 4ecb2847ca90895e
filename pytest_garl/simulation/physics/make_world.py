"""Make the physics of one flight by the engine that was chosen."""

from __future__ import annotations

from collections.abc import Sequence

from pytest_garl.engine import chosen
from pytest_garl.scenarios.bodies import Body
from pytest_garl.simulation.physics.vehicle import Vector, VehicleModel
from pytest_garl.simulation.physics.world import World


def make_world(
    model: VehicleModel,
    start_m: Vector,
    bodies: Sequence[Body],
    objects: Sequence[Body],
    ground_friction: float,
) -> World:
    """Return the world of a flight by the engine of this process; the UAV stands at its start."""
    if chosen() == "mujoco":
        from pytest_garl.simulation.physics.mujoco_world import MujocoWorld

        return MujocoWorld(model, start_m, bodies, objects, ground_friction)
    from pytest_garl.simulation.physics.bullet_world import BulletWorld

    return BulletWorld(model, start_m, bodies, objects, ground_friction)
