"""The physics of one flight by Bullet, the only module that imports pybullet."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator, Sequence

from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, GRAVITY_MPS2
from pytest_garl.scenarios.bodies import Body, Part
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector, VehicleModel
from pytest_garl.simulation.physics.world import (
    BALL_FILE,
    EXACT_RANGE_M,
    PHYSICS_RATE_HZ,
    HullContact,
    Spheres,
    hull_parts,
)


@contextlib.contextmanager
def _without_stderr() -> Iterator[None]:
    """Redirect stderr to nothing: pybullet's C code prints its build time on import."""
    saved = os.dup(2)
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)


with _without_stderr():
    import pybullet

_GEOMETRIES = {
    "box": "GEOM_BOX",
    "cylinder": "GEOM_CYLINDER",
    "sphere": "GEOM_SPHERE",
    "ellipsoid": "GEOM_MESH",
}
_PAST_HULL_M = 0.005
"""Step with which a ray leaves the UAV's own hull."""


class BulletWorld:
    """The world of one flight in Bullet.

    It is built for one flight and closed after it: restoring a saved pybullet state is not
    deterministic, but building a new world is.
    """

    def __init__(
        self,
        model: VehicleModel,
        start_m: Vector,
        bodies: Sequence[Body],
        objects: Sequence[Body],
        ground_friction: float,
    ) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._client_argument = {"physicsClientId": self._client}
        pybullet.setGravity(0, 0, -GRAVITY_MPS2, **self._client_argument)
        pybullet.setTimeStep(1 / PHYSICS_RATE_HZ, **self._client_argument)
        pybullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, **self._client_argument)
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, **self._client_argument)
        ground = pybullet.createMultiBody(0, plane, **self._client_argument)
        # The engine multiplies the friction of the two bodies, and that of the hull is 1.
        pybullet.changeDynamics(
            ground, -1, lateralFriction=ground_friction, **self._client_argument
        )
        self._ground = ground
        # Nobody sees it. A body without one gets triangles of all its parts, which takes 40 % of
        # the time to build a world.
        self._looks = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=[0.01, 0.01, 0.01], **self._client_argument
        )
        self._names = {ground: "ground"}
        self._ids: dict[str, int] = {}
        for body in (*bodies, *objects):
            self._add(body)
        self._uav = self._add_uav(model, start_m)
        self._spheres = Spheres((*bodies, *objects), model.size_m)

    def close(self) -> None:
        """Free the physics client."""
        pybullet.disconnect(**self._client_argument)

    def step(self, position: Vector, force: Vector, torque: Vector) -> None:
        """Apply a force and a torque to the UAV at ``position`` and advance by 1/240 s.

        All three are in the world frame.
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
        """Move a dynamic object to a pose; contacts depend on its velocity too."""
        body = self._ids[name]
        attitude = (0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2))
        pybullet.resetBasePositionAndOrientation(
            body, position_m, attitude, **self._client_argument
        )
        pybullet.resetBaseVelocity(body, velocity, (0, 0, 0), **self._client_argument)
        self._spheres.move(name, position_m)

    def place_uav(self, position: Vector, attitude: Quaternion) -> None:
        """Move the UAV to a pose, at rest: to begin a flight there, or to measure distances."""
        pybullet.resetBasePositionAndOrientation(
            self._uav, position, attitude, **self._client_argument
        )

    def ground_gap_m(self) -> float:
        """Return the distance in metres from the UAV's hull to the ground, up to 3 m."""
        points = pybullet.getClosestPoints(
            self._uav, self._ground, EXACT_RANGE_M, **self._client_argument
        )
        return min((point[8] for point in points), default=EXACT_RANGE_M)

    def distance_m(self, start: Vector, direction: Vector, most_m: float) -> float | None:
        """Return the distance from a place to the first body in a direction, the hull excepted.

        ``direction`` has length 1.  None if nothing lies within ``most_m``.
        """
        (x, y, z), (dx, dy, dz) = start, direction
        end = x + dx * most_m, y + dy * most_m, z + dz * most_m
        passed_m = 0.0
        while passed_m < most_m:
            begin = x + dx * passed_m, y + dy * passed_m, z + dz * passed_m
            body, _, share, _, _ = pybullet.rayTest(begin, end, **self._client_argument)[0]
            if body < 0:
                return None
            hit_m: float = passed_m + share * (most_m - passed_m)
            if body != self._uav:
                return hit_m
            passed_m = hit_m + _PAST_HULL_M
        return None

    def hull_contacts(self) -> tuple[HullContact, ...]:
        """Return the UAV's present contacts, one per body."""
        contacts = pybullet.getContactPoints(self._uav, **self._client_argument)
        if not contacts:
            return ()
        found: dict[str, HullContact] = {}
        for contact in contacts:
            # Bullet pushes bodies apart a step before they overlap, so a force without an overlap
            # is a contact too.
            distance_m, force_n = contact[8], contact[9]
            if distance_m <= 0 or force_n > 0:
                name = self._names[contact[2]]
                found.setdefault(name, HullContact(body=name, position_m=contact[6]))
        return tuple(found.values())

    def separations(self) -> dict[str, float]:
        """Return the distance in metres from the UAV's hull to each body except the ground.

        Exact within 3 m; beyond that the distance of bounding spheres, which is smaller.
        """
        uav_m = pybullet.getBasePositionAndOrientation(self._uav, **self._client_argument)[0]
        result = {}
        for name, bound in self._spheres.gaps_m(uav_m):
            result[name] = bound
            if bound < EXACT_RANGE_M:
                points = pybullet.getClosestPoints(
                    self._uav, self._ids[name], EXACT_RANGE_M, **self._client_argument
                )
                result[name] = min(
                    (point[8] for point in points), default=max(bound, EXACT_RANGE_M)
                )
        return result

    def _add_uav(self, model: VehicleModel, start_m: Vector) -> int:
        shape = self._compound(hull_parts(model.size_m))
        x, y, _ = start_m
        uav: int = pybullet.createMultiBody(
            model.mass_kg,
            shape,
            self._looks,
            basePosition=(x, y, BODY_ABOVE_FEET_M),
            **self._client_argument,
        )
        pybullet.changeDynamics(
            uav,
            -1,
            localInertiaDiagonal=model.inertia,
            linearDamping=0,
            angularDamping=0,
            lateralFriction=1.0,
            restitution=0.0,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            **self._client_argument,
        )
        self._names[uav] = "uav"
        return uav

    def _add(self, body: Body) -> None:
        """Add a body as one compound of its parts.

        The engine takes seven times as long for the same parts as links.
        """
        shape = self._compound(body.parts)
        body_id: int = pybullet.createMultiBody(
            0,
            shape,
            self._looks,
            basePosition=body.position_m,
            baseOrientation=(0.0, 0.0, math.sin(body.yaw_rad / 2), math.cos(body.yaw_rad / 2)),
            **self._client_argument,
        )
        self._ids[body.name] = body_id
        self._names[body_id] = body.name

    def _compound(self, parts: Sequence[Part]) -> int:
        shape: int = pybullet.createCollisionShapeArray(
            shapeTypes=[getattr(pybullet, _GEOMETRIES[part.shape]) for part in parts],
            radii=[part.size_m[0] / 2 for part in parts],
            lengths=[part.size_m[2] for part in parts],
            halfExtents=[[side / 2 for side in part.size_m] for part in parts],
            fileNames=[str(BALL_FILE) if part.shape == "ellipsoid" else "" for part in parts],
            meshScales=[list(part.size_m) for part in parts],
            collisionFramePositions=[part.position_m for part in parts],
            collisionFrameOrientations=[part.rotation for part in parts],
            **self._client_argument,
        )
        return shape
