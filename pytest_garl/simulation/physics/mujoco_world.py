"""The physics of one flight by MuJoCo, the only module that imports mujoco.

MuJoCo's contacts are springs and dampers, where Bullet's are rigid, and its friction is a damper
with Coulomb's limit.  What they ask for beside the figures of the vehicle and the ground follows
from these facts: feet of rubber do not rebound, a UAV that stands does not creep, and one that
slides is braked by Coulomb's friction.  The numbers are from MuJoCo's documentation (4.0,
"Modeling": solver parameters, tuning defaults) and its model of a contact,

    a = (1 - d) a0 - d (b v + k r),  b = 2 / (d tc),  k = d / (d tc damping ratio)²

for the depth r and its speed v.  The tests of this folder hold both engines against closed forms.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, GRAVITY_MPS2
from pytest_garl.scenarios.bodies import Body, Part, rotate
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector, VehicleModel
from pytest_garl.simulation.physics.world import (
    BALL_FILE,
    BODY_FRICTION,
    EXACT_RANGE_M,
    PHYSICS_RATE_HZ,
    HullContact,
    Spheres,
    hull_parts,
)

_NORMAL = (2 / PHYSICS_RATE_HZ, 4.0)
"""``solref`` of a contact: its time constant tc and its damping ratio.  Two steps is the least tc
that the documentation allows.  The damper then stops an impact within one step, and the spring
gives back ``1 / (4 ratio²)`` of its speed: 25 % with critical damping, 2 % with this.  Smaller
steps near the ground are no way out: at 1,920 Hz the solver threw a UAV that stood into the air."""
_SIDEWAYS = (0.05, 1.0)
"""``solreffriction``: the same of friction, whose damper takes a sideways speed in 0.05 s.  In this
model a UAV that slides is also lifted, by ``friction tc_normal / tc_sideways`` of its speed, which
is 10 %; with the tc of the normal contact it would be all of it.  So a UAV that skids over the
ground with its motors running hops."""
_IMPEDANCE = (0.95, 0.95, 0.001, 0.5, 2.0)
"""``solimp``: d, the documentation's value for less creep, the same at each depth."""
_FRICTION_OVER_NORMAL = 10.0
"""``impratio``: how much stiffer friction is than the normal contact; the documentation's value.  A
UAV that stands creeps by ``(1 - d) a0 tc_sideways / 20``: 0.2 mm/s in a wind of 8 m/s."""
_TOLERANCE = 1e-12
"""Below the default, so that the solver does not stop at the solution of the step before."""
_GEOMETRIES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_MESH,
}


class MujocoWorld:
    """The world of one flight in MuJoCo.

    The ground and bodies that stand are part of its world; dynamic objects are its "mocap" bodies,
    which are where they are put, and push what they touch as one that stands would.
    """

    def __init__(
        self,
        model: VehicleModel,
        start_m: Vector,
        bodies: Sequence[Body],
        objects: Sequence[Body],
        ground_friction: float,
    ) -> None:
        spec = mujoco.MjSpec()
        option = spec.option
        option.timestep = 1 / PHYSICS_RATE_HZ
        option.gravity = [0, 0, -GRAVITY_MPS2]
        # It integrates the gyroscopic torque of a free body exactly.
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = _FRICTION_OVER_NORMAL
        option.tolerance = _TOLERANCE
        ground = spec.worldbody.add_geom(
            name="ground",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0, 0, 1],
            contype=0,
            conaffinity=0,
        )
        names = {"ground": [ground]}
        mocap: dict[str, Any] = {}
        for body in (*bodies, *objects):
            is_moved = any(body is each for each in objects)
            holder = spec.worldbody.add_body(
                pos=body.position_m, quat=_yaw(body.yaw_rad), mocap=is_moved
            )
            names[body.name] = [_add(spec, holder, part) for part in body.parts]
            if is_moved:
                mocap[body.name] = holder
        self._hull_parts = hull_parts(model.size_m)
        uav, hull = _add_uav(spec, model, start_m, self._hull_parts)
        for geom in hull:
            _stand(spec, geom, ground_friction)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._uav: int = uav.id
        self._hull: list[int] = [geom.id for geom in hull]
        self._mocap = {name: int(self._model.body_mocapid[each.id]) for name, each in mocap.items()}
        self._geoms: dict[str, list[int]] = {
            name: [geom.id for geom in geoms] for name, geoms in names.items()
        }
        self._names = {geom: name for name, geoms in self._geoms.items() for geom in geoms}
        self._spheres = Spheres((*bodies, *objects), model.size_m)
        self._push = self._data.xfrc_applied[self._uav]
        self._qpos, self._qvel = self._data.qpos, self._data.qvel
        self._hit, self._between = np.zeros(1, np.int32), np.zeros(6)
        self._placed = False

    def close(self) -> None:
        """Nothing is to be done: Python frees the model with this object."""

    def step(self, position: Vector, force: Vector, torque: Vector) -> None:
        """Apply a force and a torque to the UAV at ``position`` and advance by 1/240 s.

        All three are in the world frame.
        """
        # MuJoCo applies the force at the centre of mass.
        x, y, z = (at - own for at, own in zip(position, self._qpos[:3].tolist(), strict=True))
        (fx, fy, fz), (tx, ty, tz) = force, torque
        self._push[:] = fx, fy, fz, tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx
        mujoco.mj_step(self._model, self._data)
        self._placed = False

    def uav_state(self) -> tuple[Vector, Quaternion, Vector, Vector]:
        """Position, attitude, velocity and angular velocity of the UAV, in the world frame."""
        x, y, z, qw, qx, qy, qz = self._qpos.tolist()
        vx, vy, vz, *spin = self._qvel.tolist()
        attitude = (qx, qy, qz, qw)
        # The spin of a free body is in its own frame.
        return (x, y, z), attitude, (vx, vy, vz), rotate(attitude, (spin[0], spin[1], spin[2]))

    def move(self, name: str, position_m: Vector, yaw_rad: float, velocity: Vector) -> None:
        """Move a dynamic object to a pose; its velocity is for other engines."""
        index = self._mocap[name]
        self._data.mocap_pos[index] = position_m
        self._data.mocap_quat[index] = _yaw(yaw_rad)
        self._spheres.move(name, position_m)
        self._placed = False

    def place_uav(self, position: Vector, attitude: Quaternion) -> None:
        """Move the UAV to a pose, at rest: to begin a flight there, or to measure distances."""
        x, y, z, w = attitude
        self._qpos[:] = (*position, w, x, y, z)
        self._qvel[:] = 0
        self._placed = False

    def ground_gap_m(self) -> float:
        """Return the distance in metres from the UAV's hull to the ground, up to 3 m."""
        self._place()
        z = float(self._data.xpos[self._uav][2])
        a, b, c = self._data.xmat[self._uav][6:].tolist()
        least = EXACT_RANGE_M
        for part in self._hull_parts:
            (px, py, pz), (sx, sy, sz) = part.position_m, part.size_m
            if part.shape == "box":
                reach = abs(a) * sx / 2 + abs(b) * sy / 2 + abs(c) * sz / 2
            else:
                reach = math.hypot(a, b) * sx / 2 + abs(c) * sz / 2
            least = min(least, z + a * px + b * py + c * pz - reach)
        return least

    def distance_m(self, start: Vector, direction: Vector, most_m: float) -> float | None:
        """Return the distance from a place to the first body in a direction, the hull excepted.

        ``direction`` has length 1.  None if nothing lies within ``most_m``.
        """
        self._place()
        hit_m = mujoco.mj_ray(
            self._model,
            self._data,
            np.array(start),
            np.array(direction),
            None,
            True,
            self._uav,
            self._hit,
        )
        return hit_m if 0 <= hit_m <= most_m else None

    def hull_contacts(self) -> tuple[HullContact, ...]:
        """Return the UAV's present contacts, one per body."""
        if not self._data.ncon:
            return ()
        contact = self._data.contact
        found: dict[str, HullContact] = {}
        for pair, (x, y, z) in zip(contact.geom.tolist(), contact.pos.tolist(), strict=True):
            name = self._names[pair[0] if pair[1] in self._hull else pair[1]]
            found.setdefault(name, HullContact(body=name, position_m=(x, y, z)))
        return tuple(found.values())

    def separations(self) -> dict[str, float]:
        """Return the distance in metres from the UAV's hull to each body except the ground.

        Exact within 3 m; beyond that the distance of bounding spheres, which is smaller.
        """
        self._place()
        x, y, z = self._qpos[:3].tolist()
        result = {}
        for name, bound in self._spheres.gaps_m((x, y, z)):
            result[name] = bound
            if bound < EXACT_RANGE_M:
                gap = self._gap_m(name)
                result[name] = gap if gap < EXACT_RANGE_M else max(bound, EXACT_RANGE_M)
        return result

    def _gap_m(self, name: str) -> float:
        least = EXACT_RANGE_M
        for geom in self._geoms[name]:
            for hull in self._hull:
                gap = mujoco.mj_geomDistance(
                    self._model, self._data, hull, geom, least, self._between
                )
                least = min(least, gap)
        return least

    def _place(self) -> None:
        """Let the engine know where bodies are: it computes that at the begin of a step only."""
        if not self._placed:
            mujoco.mj_kinematics(self._model, self._data)
            self._placed = True


def _stand(spec: Any, geom: Any, friction: float) -> None:
    """Let a part of the hull stand on the ground."""
    spec.add_pair(
        geomname1="ground",
        geomname2=geom.name,
        condim=3,
        friction=[friction, friction, 0, 0, 0],
        solref=_NORMAL,
        solreffriction=_SIDEWAYS,
        solimp=_IMPEDANCE,
    )


def _add(spec: Any, holder: Any, part: Part, **settings: Any) -> Any:
    """Add a part to a body; return its geometry.  Bodies meet the hull, and nothing else."""
    x, y, z, w = part.rotation
    sides = [side / 2 for side in part.size_m]
    shape: dict[str, Any] = {"size": sides}
    if part.shape == "cylinder":
        shape = {"size": [sides[0], sides[2], 0]}
    elif part.shape == "ellipsoid":
        shape = {"meshname": _mesh(spec, part.size_m)}
    # Of the frictions of two bodies the larger one counts.
    meets = {"contype": 0, "conaffinity": 1, "friction": [BODY_FRICTION, 0, 0], **settings}
    return holder.add_geom(
        type=_GEOMETRIES[part.shape],
        pos=part.position_m,
        quat=[w, x, y, z],
        solref=_NORMAL,
        solimp=_IMPEDANCE,
        **shape,
        **meets,
    )


def _mesh(spec: Any, size_m: Vector) -> str:
    """Return the name of a ball that is stretched to a size; equal sizes share it."""
    name = repr(size_m)
    if spec.mesh(name) is None:
        vertices = [
            value * side for row in _ball() for value, side in zip(row, size_m, strict=True)
        ]
        spec.add_mesh(name=name, uservert=vertices)
    return name


@functools.cache
def _ball() -> tuple[Vector, ...]:
    return tuple(_vertices())


def _vertices() -> Iterator[Vector]:
    for line in BALL_FILE.read_text(encoding="utf-8").splitlines():
        if line.startswith("v "):
            x, y, z = map(float, line.split()[1:])
            yield x, y, z


def _add_uav(
    spec: Any, model: VehicleModel, start_m: Vector, parts: Sequence[Part]
) -> tuple[Any, list[Any]]:
    x, y, _ = start_m
    uav = spec.worldbody.add_body(pos=[x, y, BODY_ABOVE_FEET_M])
    uav.add_freejoint()
    uav.explicitinertial = True
    uav.mass, uav.inertia = model.mass_kg, model.inertia
    # Else the centre of mass is that of the geometries.
    uav.ipos, uav.iquat = [0, 0, 0], [1, 0, 0, 0]
    meets = {"contype": 1, "conaffinity": 0, "friction": [0, 0, 0], "mass": 0}
    hull = [_add(spec, uav, part, name=f"hull {part.shape}", **meets) for part in parts]
    return uav, hull


def _yaw(yaw_rad: float) -> list[float]:
    return [math.cos(yaw_rad / 2), 0, 0, math.sin(yaw_rad / 2)]
