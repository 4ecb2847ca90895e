"""What an NPC and a UAV do to each other by geometry: who sees whom, and whether they meet.

The UAV's path does not depend on an NPC before the NPC is in the picture.  So one recorded flight
tells for each moment at which an NPC could have begun whether it would have met the UAV, without
another flight, as far as the UAV did not see it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pytest_garl.airframe import Airframe, Camera
from pytest_garl.flight.flight import Track
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.npcs.director import Features, Watch
from pytest_garl.npcs.grades import GRADE_LIMITS
from pytest_garl.npcs.interference import Interfering
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import ObjectType
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.meshes import rotation_matrix
from pytest_garl.simulation.camera.true_camera import mount_of
from pytest_garl.simulation.landing_moments import LandingMoments
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Situation
from pytest_garl.simulation.physics.make_world import make_world
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.physics.vehicle import vehicle_model
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ

FRAME_S = 0.1
"""A body is seen if it is in the picture now and was one frame of the default camera before."""
NOTICED_S = 0.3
"""Time from the first sight to the first command of an escape, as in the question whether a real
collision was preventable (:data:`pytest_garl.cases.case.REACTION_S`)."""
ESCAPE_S = 1.0
"""A UAV needs this time to get out of the way: of the 41 collisions that
docs/results/preventability.csv asked about, each had an escape 1 s before the contact, and half of
them none 0.5 s before it."""
WITHIN_S = 5.3
"""What the camera showed longer before a contact does not count
(:data:`pytest_garl.cases.case.OBSERVED_WITHIN_S`)."""
COLLISION_WORTH, PREVENTABLE_WORTH = 0.25, 1.0
"""What a director's begin is worth.  A collision that nobody could have prevented shows little of a
landing system, but it is on the way to one that somebody could."""
TICKS_PER_NPC_STEP = 4
"""As in the flight's loop."""
AFTERMATH_STEPS = 6
"""Half seconds for which an NPC is moved on after its time: it may collide as it leaves."""
WATCHES_S = 0.5 + max(limits.delay_s for limits in GRADE_LIMITS.values())
"""What an NPC saw up to this long before it begins may still be perceived."""
_STEPS = round(DECISION_STEP_S * PHYSICS_RATE_HZ / TICKS_PER_NPC_STEP)
_NEAR_M = 0.3
"""Bodies whose bounds are farther apart are not measured."""
_HEIGHTS = (0.0, 0.5, 1.0)
"""Parts of a body of which one must be in the picture, as shares of its height."""


def in_picture(
    uav: Track, body_m: NDArray[np.float64], kind: ObjectType, camera: Camera
) -> NDArray[np.bool_]:
    """Return for each sample of a track whether the camera below the UAV shows a body, (n,).

    ``body_m`` (n, 3) is where the body is.  It is in the picture if the middle of its lowest part,
    of its height or of its top is; what hides it, and how large it looks, is left out.
    """
    x, y, z, w = uav.attitude.T
    # The rows of the body's axes in the world: forward, left and up.
    forward = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], 1)
    left = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], 1)
    up = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], 1)
    x, y, z = camera.offset_m
    eye = uav.position_m + z * up
    if x or y:
        eye = eye + x * forward + y * left
    if camera.is_turned:
        body = np.stack([forward, left, up], 2)
        forward, left, up = np.moveaxis(body @ rotation_matrix(mount_of(camera)), 2, 0)
    half_width = math.tan(camera.field_of_view_rad / 2)
    half_height = half_width * camera.height_px / camera.width_px
    shown = np.zeros(len(eye), dtype=bool)
    for share in _HEIGHTS:
        point = body_m + np.array([0.0, 0.0, kind.low_m + share * kind.height_m]) - eye
        ahead, aside = (np.einsum("ij,ij->i", point, axis) for axis in (forward, left))
        deep = -np.einsum("ij,ij->i", point, up)
        shown |= (
            (deep > 0) & (np.abs(aside) < half_width * deep) & (np.abs(ahead) < half_height * deep)
        )
    return shown


def first_seen_s(uav: Track, shown: NDArray[np.bool_], since_s: float = -math.inf) -> float | None:
    """Return when a body was seen for the first time after ``since_s``; None if never.

    ``shown``, (n,), says for each sample of the track whether the body is in the picture.
    """
    before = np.searchsorted(uav.time_s, uav.time_s - FRAME_S + 1e-6, side="right") - 1
    seen = shown & shown[np.maximum(before, 0)] & (before >= 0)
    seen &= uav.time_s[np.maximum(before, 0)] >= since_s
    found = np.flatnonzero(seen)
    return float(uav.time_s[found[0]]) if len(found) else None


def could_be_prevented(contact_s: float, seen_s: float | None) -> bool:
    """Return whether a UAV could probably have escaped from a body that it saw before a contact."""
    return seen_s is not None and contact_s - seen_s >= NOTICED_S + ESCAPE_S


def begins_at(scenario: Scenario, name: str, moment_s: float) -> Scenario:
    """Return a scenario in which an NPC begins at a time after the start of the flight."""
    return scenario.replace({f"{name}.phase": 0.0, f"{name}.delay_s": moment_s})


@dataclass(frozen=True, slots=True, kw_only=True)
class Encounter:
    """How one NPC meets a UAV on its recorded way, if it begins at a moment.

    ``contact_s`` is when they touch, None if they do not; ``seen_s`` when the UAV sees the NPC for
    the first time; ``nearest_m`` the least horizontal distance.
    """

    moment_s: float
    contact_s: float | None
    seen_s: float | None
    nearest_m: float

    def meets(self, until_s: float = math.inf) -> bool | None:
        """Return whether they meet; None if the UAV saw the NPC, and what it does then is unknown.

        ``until_s`` is until when the recorded way holds: that of a flight in which the UAV saw the
        NPC holds up to there.
        """
        known_s = min(until_s, math.inf if self.seen_s is None else self.seen_s)
        if self.contact_s is not None and self.contact_s <= known_s:
            return True
        return False if math.isinf(known_s) else None


class Passage:
    """A recorded way of a UAV, along which one NPC is moved again and again; close it afterwards.

    Other NPCs are left out.  The NPC's policy must not draw random numbers.
    """

    def __init__(
        self,
        uav: Track,
        scenario: Scenario,
        map: Map,
        name: str,
        airframe: Airframe,
        policy: Callable[[], Interfering],
    ) -> None:
        self._uav, self._scenario, self._map, self._name = uav, scenario, map, name
        self._policy, self._camera = policy, airframe.camera
        placed = Placed(scenario, map)
        self._marker_m, self._kind = placed.marker_m, placed.npc(name).type
        body = Npc(placed, name, policy()).body
        self._world = make_world(vehicle_model(airframe), map.uav_start_m, (), [body], 1.0)
        self._reach_m = airframe.size_m / 2 + self._kind.radius_m + _NEAR_M
        self._last = math.floor(float(uav.time_s[-1]) * PHYSICS_RATE_HZ / TICKS_PER_NPC_STEP)
        times = np.arange(self._last + 1) * TICKS_PER_NPC_STEP / PHYSICS_RATE_HZ
        self._times = times
        self._places, self._velocities = (
            np.stack([np.interp(times, uav.time_s, column) for column in table.T], axis=1).tolist()
            for table in (uav.position_m, uav.velocity_mps)
        )
        moments = LandingMoments()
        self._moments = []
        for time_s, place in zip(times.tolist(), self._places, strict=True):
            moments.update(time_s, feet_height_m(place[2]))
            self._moments.append(moments.began_s)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._world.close()

    def waiting(self) -> list[Features]:
        """Return what the NPC knows at each decision if it waits to the end."""
        placed = Placed(self._scenario, self._map)
        npc, watch = Npc(placed, self._name, self._policy()), None
        rows = []
        for step in range(0, self._last + 1, _STEPS):
            situation = self._situation(npc, placed, step)
            watch = watch or Watch(situation)
            rows.append(watch.look(situation))
        return rows

    def begin_at(self, moment_s: float) -> Encounter:
        """Return how the NPC meets the UAV if it begins at a moment, a multiple of 0.5 s."""
        placed = Placed(begins_at(self._scenario, self._name, moment_s), self._map)
        policy = self._policy()
        npc = Npc(placed, self._name, policy)
        # It perceives later what it sees before it begins; a body that waits does not move.
        first = max(0, round((moment_s - WATCHES_S) / DECISION_STEP_S)) * _STEPS
        policy.reset(self._situation(npc, placed, first), np.random.default_rng(0))
        way, contact_s, nearest_m, left = [], None, math.inf, AFTERMATH_STEPS
        for step in range(first, self._last + 1):
            time_s, uav_m = float(self._times[step]), self._places[step]
            if step % _STEPS == 0:
                npc.decide(self._situation(npc, placed, step))
                left -= policy.is_over
                if left < 0:
                    break
            vx, vy, vz = self._velocities[step]
            uav_place = (uav_m[0], uav_m[1], uav_m[2])
            npc.update(time_s, self._moments[step], uav_place, (vx, vy, vz))
            npc.advance(TICKS_PER_NPC_STEP / PHYSICS_RATE_HZ)
            way.append(npc.position_m)
            away_m = math.dist(npc.position_m[:2], uav_m[:2])
            nearest_m = min(nearest_m, away_m)
            if away_m < self._reach_m and self._touches(npc, time_s, uav_m):
                contact_s = time_s
                break
        return Encounter(
            moment_s=moment_s,
            contact_s=contact_s,
            seen_s=self._seen_s(first, way),
            nearest_m=nearest_m,
        )

    def _situation(self, npc: Npc, placed: Placed, step: int) -> Situation:
        (x, y, z), (vx, vy, vz) = self._places[step], self._velocities[step]
        return Situation(
            time_s=float(self._times[step]),
            self=npc.state,
            others=(),
            uav_position_m=(x, y, z),
            uav_velocity_mps=(vx, vy, vz),
            marker_position_m=self._marker_m,
            map=self._map,
            scenario=placed.scenario,
            moments_s=(*self._moments[step], npc.met_s, npc.decided_s),
        )

    def _touches(self, npc: Npc, time_s: float, uav_m: Sequence[float]) -> bool:
        x, y, z, w = self._uav.attitude[self._uav.index_at(time_s + 1e-6)].tolist()
        self._world.move(npc.name, npc.position_m, npc.yaw_rad, npc.velocity_mps)
        self._world.place_uav((uav_m[0], uav_m[1], uav_m[2]), (x, y, z, w))
        return self._world.separations()[npc.name] <= 0

    def _seen_s(self, first: int, way: Sequence[tuple[float, float, float]]) -> float | None:
        """Return when the camera shows the NPC on its way."""
        times = self._times[first : first + len(way)]
        inside = (self._uav.time_s >= times[0] - 1e-6) & (self._uav.time_s <= times[-1] + 1e-6)
        uav = Track(
            time_s=self._uav.time_s[inside],
            position_m=self._uav.position_m[inside],
            attitude=self._uav.attitude[inside],
            velocity_mps=self._uav.velocity_mps[inside],
        )
        if not len(uav.time_s):
            return None
        body = [np.interp(uav.time_s, times, column) for column in np.array(way).T]
        shown = in_picture(uav, np.stack(body, axis=1), self._kind, self._camera)
        return first_seen_s(uav, shown)
