"""Outcome of contacts: the UAV has landed, has collided, or is still flying."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pytest_garl.simulation.flight import Outcome
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector
from pytest_garl.simulation.physics.world import HullContact, World
from pytest_garl.simulation.recorder import Recorder

LANDED_SPEED_MPS = 0.2
LANDED_TILT_RAD = math.radians(20)
LANDED_AFTER_S = 1.0
AIRBORNE_M = 1.0
HARD_TOUCHDOWN_MPS = 2.0
"""Contact speed of a drop from 0.2 m: the least drop height of EASA CS 27.725."""
ABORT_CLEAR_M = 2.0
ABORT_HEIGHT_M = 5.0
CLEAR_OF_CONTACT_M = 2.0
"""A body this far away cannot be touched before the next sample of the track, so the engine is not
queried: within 10 steps the two would have to approach at 48 m/s."""


class Contacts:
    """Watches the contacts of the UAV and its distance from every body.

    ``landed_since`` is when the UAV came to rest on the ground, None while it moves.
    """

    def __init__(
        self, world: World, recorder: Recorder, npcs: Sequence[Npc], hull_m: float
    ) -> None:
        self._world, self._recorder, self._npcs = world, recorder, npcs
        self._hull_m = hull_m
        self._airborne = False
        self._gaps: dict[str, float] = {}
        self._nothing_near = False
        self.landed_since: float | None = None

    def record_pose(self, time_s: float) -> None:
        """Add a sample to the tracks, with the distance to every body."""
        position, attitude, velocity, _ = self._world.uav_state()
        gaps = self._world.separations()
        gaps.update({name: 0.0 for name, gap in self._gaps.items() if gap == 0.0})
        self._gaps = gaps
        least = min(gaps.values(), default=math.inf)
        above_ground = position[2] - self._hull_m
        self._nothing_near = min(least, above_ground) > CLEAR_OF_CONTACT_M
        self._recorder.pose(time_s, position, attitude, velocity, gaps)

    def clear_of_everything(self, position: Vector) -> bool:
        """Whether an aborting UAV has climbed clear of every body."""
        return position[2] >= ABORT_HEIGHT_M and all(
            gap >= ABORT_CLEAR_M for gap in self._gaps.values()
        )

    def outcome(
        self, time_s: float, position: Vector, attitude: Quaternion, velocity: Vector
    ) -> Outcome | None:
        """Return "collision" or "landed" once the contacts at this moment say so."""
        if not self._airborne and position[2] > AIRBORNE_M:
            self._airborne = True
            self._recorder.event("took_off", "left the ground")
        touches = () if self._nothing_near else self._world.hull_contacts()
        if not touches:
            self.landed_since = None
            return None
        x, y, _, _ = attitude
        tilt = math.acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y))))
        for touch in touches:
            if self._is_collision(touch, velocity, tilt):
                self.record_pose(time_s)
                return "collision"
        speed = math.sqrt(sum(value * value for value in velocity))
        if not self._airborne or speed >= LANDED_SPEED_MPS or tilt >= LANDED_TILT_RAD:
            self.landed_since = None
            return None
        if self.landed_since is None:
            self.landed_since = time_s
        if time_s - self.landed_since < LANDED_AFTER_S:
            return None
        self.record_pose(time_s)
        self._recorder.event("landed", "at rest on the ground")
        return "landed"

    def _is_collision(self, touch: HullContact, velocity: Vector, tilt_rad: float) -> bool:
        """Record the first contact with a body; return whether the contact ends the flight."""
        if touch.body != "ground":
            approach = self._approach_mps(touch.body, velocity)
            self._recorder.contact(touch.body, touch.position_m, approach, tilt_rad)
            self._gaps[touch.body] = 0.0
            return True
        if not self._airborne or self._recorder.touched_ground:
            return False
        sink_mps = abs(velocity[2])
        self._recorder.contact("ground", touch.position_m, sink_mps, tilt_rad)
        return sink_mps > HARD_TOUCHDOWN_MPS or tilt_rad > LANDED_TILT_RAD

    def _approach_mps(self, body: str, velocity: Vector) -> float:
        """Return the UAV's speed relative to a body: a moving one may hit a hovering UAV."""
        moving = next((npc for npc in self._npcs if npc.name == body), None)
        vx, vy = (moving.vx_mps, moving.vy_mps) if moving else (0.0, 0.0)
        return math.dist(velocity, (vx, vy, 0.0))
