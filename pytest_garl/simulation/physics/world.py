"""The physical world: the only module that knows pybullet."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.scenarios.bodies import Body
from pytest_garl.simulation.physics.vehicle import (
    BODY_ABOVE_FEET_M,
    GRAVITY_MPS2,
    Quaternion,
    Vector,
    VehicleModel,
)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Silence file descriptor 2: pybullet's C code announces its build time on import."""
    saved = os.dup(2)
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)


with _quiet():
    import pybullet

PHYSICS_RATE_HZ = 240
_KINDS = {
    "box": "GEOM_BOX",
    "cylinder": "GEOM_CYLINDER",
    "sphere": "GEOM_SPHERE",
    "ellipsoid": "GEOM_MESH",
}
_BALL = str(Path(__file__).with_name("unit_ball.obj"))
"""The vertices of a ball of diameter 1 as the camera draws it: 10 sides, 5 rings; the engine
takes their convex hull."""
_RANGE_M = 3.0
"""Distances beyond this are bounded by spheres instead of asked of the engine."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HullContact:
    """A contact of the UAV's hull with a body, or with "ground"."""

    body: str
    position_m: Vector


class World:
    """One flight's physics: ground, static bodies, dynamic objects and the UAV's hull.

    A world is built for one flight and closed after it: saving and restoring a pybullet
    state is not deterministic, building it anew is.
    """

    def __init__(
        self,
        model: VehicleModel,
        start_m: Vector,
        bodies: Sequence[Body],
        objects: Sequence[Body],
    ) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._p = pybullet
        self._call = {"physicsClientId": self._client}
        self._p.setGravity(0, 0, -GRAVITY_MPS2, **self._call)
        self._p.setTimeStep(1 / PHYSICS_RATE_HZ, **self._call)
        self._p.setPhysicsEngineParameter(deterministicOverlappingPairs=1, **self._call)
        plane = self._p.createCollisionShape(self._p.GEOM_PLANE, **self._call)
        ground = self._p.createMultiBody(0, plane, **self._call)
        self._names = {ground: "ground"}
        self._spheres: dict[int, tuple[Vector, float]] = {}
        self._ids: dict[str, int] = {}
        for body in (*bodies, *objects):
            self._add(body)
        self._uav = self._add_uav(model, start_m)
        self._reach = model.size_m * 0.6

    def close(self) -> None:
        """Free the physics client."""
        self._p.disconnect(**self._call)

    def step(self, position: Vector, force: Vector, torque: Vector) -> None:
        """Advance by 1/240 s under a force and a torque on the UAV, which is at ``position``.

        All are in the world frame.
        """
        client, uav = self._client, self._uav
        pybullet.applyExternalForce(uav, -1, force, position, pybullet.WORLD_FRAME, client)
        pybullet.applyExternalTorque(uav, -1, torque, pybullet.WORLD_FRAME, client)
        pybullet.stepSimulation(client)

    def uav_state(self) -> tuple[Vector, Quaternion, Vector, Vector]:
        """Position, attitude, velocity and angular velocity of the UAV, in the world frame."""
        position, attitude = pybullet.getBasePositionAndOrientation(self._uav, self._client)
        velocity, spin = pybullet.getBaseVelocity(self._uav, self._client)
        return position, attitude, velocity, spin

    def move(self, name: str, position_m: Vector, yaw_rad: float, velocity: Vector) -> None:
        """Put a dynamic object somewhere; its velocity makes contacts feel right."""
        body = self._ids[name]
        attitude = (0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2))
        self._p.resetBasePositionAndOrientation(body, position_m, attitude, **self._call)
        self._p.resetBaseVelocity(body, velocity, (0, 0, 0), **self._call)
        self._spheres[body] = (position_m, self._spheres[body][1])

    def hull_contacts(self) -> tuple[HullContact, ...]:
        """Return the UAV's present contacts, one per body."""
        contacts = self._p.getContactPoints(self._uav, **self._call)
        if not contacts:
            return ()
        found: dict[str, HullContact] = {}
        for contact in contacts:
            # Bullet pushes bodies apart a step before they overlap: force without overlap is
            # a contact as well.
            if contact[8] <= 0 or contact[9] > 0:
                name = self._names[contact[2]]
                found.setdefault(name, HullContact(body=name, position_m=contact[6]))
        return tuple(found.values())

    def separations(self) -> dict[str, float]:
        """Distance in metres from the UAV's hull to each body but the ground.

        Exact within 3 m; beyond, the distance of bounding spheres, which is smaller.
        """
        x, y, z = self._p.getBasePositionAndOrientation(self._uav, **self._call)[0]
        result = {}
        for name, body in self._ids.items():
            (cx, cy, cz), radius = self._spheres[body]
            bound = math.dist((x, y, z), (cx, cy, cz)) - radius - self._reach
            if bound < _RANGE_M:
                points = self._p.getClosestPoints(self._uav, body, _RANGE_M, **self._call)
                bound = min((point[8] for point in points), default=max(bound, _RANGE_M))
            result[name] = bound
        return result

    def _add_uav(self, model: VehicleModel, start_m: Vector) -> int:
        # The rotors' disc, and below it the landing gear on which the body stands.
        disc, gear = 0.10, BODY_ABOVE_FEET_M - 0.02
        shape = self._p.createCollisionShapeArray(
            shapeTypes=[self._p.GEOM_CYLINDER, self._p.GEOM_BOX],
            radii=[model.size_m / 2, 0.0],
            lengths=[disc, 0.0],
            halfExtents=[[0, 0, 0], [0.18 * model.size_m, 0.18 * model.size_m, gear / 2]],
            collisionFramePositions=[[0, 0, 0.03], [0, 0, -0.02 - gear / 2]],
            **self._call,
        )
        x, y, _ = start_m
        uav: int = self._p.createMultiBody(
            model.mass_kg, shape, basePosition=(x, y, BODY_ABOVE_FEET_M), **self._call
        )
        self._p.changeDynamics(
            uav,
            -1,
            localInertiaDiagonal=model.inertia,
            linearDamping=0,
            angularDamping=0,
            lateralFriction=0.5,
            restitution=0.0,
            activationState=self._p.ACTIVATION_STATE_DISABLE_SLEEPING,
            **self._call,
        )
        self._names[uav] = "uav"
        return uav

    def _add(self, body: Body) -> None:
        """Add a body as one compound of its parts.

        A compound costs the engine a seventh of the same parts as links.
        """
        parts = body.parts
        shape = self._p.createCollisionShapeArray(
            shapeTypes=[getattr(self._p, _KINDS[part.shape]) for part in parts],
            radii=[part.size_m[0] / 2 for part in parts],
            lengths=[part.size_m[2] for part in parts],
            halfExtents=[[side / 2 for side in part.size_m] for part in parts],
            fileNames=[_BALL if part.shape == "ellipsoid" else "" for part in parts],
            meshScales=[list(part.size_m) for part in parts],
            collisionFramePositions=[part.position_m for part in parts],
            collisionFrameOrientations=[part.rotation for part in parts],
            **self._call,
        )
        number: int = self._p.createMultiBody(
            0,
            shape,
            basePosition=body.position_m,
            baseOrientation=(0.0, 0.0, math.sin(body.yaw_rad / 2), math.cos(body.yaw_rad / 2)),
            **self._call,
        )
        radius = max(math.hypot(*part.position_m) + math.hypot(*part.size_m) / 2 for part in parts)
        self._ids[body.name] = number
        self._names[number] = body.name
        self._spheres[number] = (body.position_m, radius)
