"""Contacts of the UAV with bodies and with the ground, and the outcomes that follow from them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pytest_garl.flight.flight import Outcome, Touchdown
from pytest_garl.simulation.ground_periods import GroundPeriods
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector
from pytest_garl.simulation.physics.world import HullContact, World
from pytest_garl.simulation.recorder import Recorder

AIRBORNE_M = 1.0
ABORT_CLEAR_M = 2.0
ABORT_HEIGHT_M = 5.0
SETTLING_S = 5.0
"""A UAV that touched down before the time limit may fly on for this time: 1.4 s until motors stop
and 2 s in which it is watched, with half as much in reserve."""
CLEAR_OF_CONTACT_M = 2.0
"""A body this far away cannot be touched before the next sample of the track, so the engine is not
queried: within 10 steps the two would have to approach at 48 m/s."""


class Contacts:
    """Watches the contacts of the UAV and its distance from every body."""

    def __init__(
        self,
        world: World,
        recorder: Recorder,
        npcs: Sequence[Npc],
        hull_m: float,
        stays: GroundPeriods,
    ) -> None:
        self._world, self._recorder, self._npcs = world, recorder, npcs
        self._hull_m, self._stays = hull_m, stays
        self._airborne = world.uav_state()[0][2] > AIRBORNE_M
        self._gaps: dict[str, float] = {}
        self._touched: set[str] = set()
        self._nothing_near = False

    @property
    def motors_stopped(self) -> bool:
        """Whether the motors have stopped on the ground, for the rest of the flight."""
        return self._stays.motors_stopped

    @property
    def touchdowns(self) -> tuple[Touchdown, ...]:
        """The touchdowns so far."""
        return tuple(self._stays.touchdowns)

    def on_ground_s(self, time_s: float) -> float:
        """Return for how long the UAV has been on the ground since its touchdown; 0 in the air."""
        since_s = self._stays.since_s
        return 0.0 if since_s is None else time_s - since_s

    def settling(self, time_s: float, limit_s: float) -> bool:
        """Whether the UAV touched down before a limit and is about to come to its outcome."""
        stays = self._stays
        if stays.since_s is None or stays.since_s >= limit_s or time_s >= limit_s + SETTLING_S:
            return False
        decided = stays.motors_stopped or stays.has_slid
        return decided or time_s < stays.since_s + SETTLING_S

    def record_pose(self, time_s: float) -> None:
        """Add a sample to the tracks, with the distance to every body.

        After the motors stopped, an approaching body is no matter of the landing system.
        """
        position, attitude, velocity, _ = self._world.uav_state()
        gaps = self._world.separations()
        gaps.update({name: 0.0 for name, gap in self._gaps.items() if gap == 0.0})
        self._gaps = gaps
        least = min(gaps.values(), default=math.inf)
        above_ground = position[2] - self._hull_m
        self._nothing_near = min(least, above_ground) > CLEAR_OF_CONTACT_M
        if self.motors_stopped:
            moving = {npc.name for npc in self._npcs}
            gaps = {name: gap for name, gap in gaps.items() if name not in moving}
        self._recorder.pose(time_s, position, attitude, velocity, gaps)

    def gave_up(self, position: Vector) -> bool:
        """Whether an aborting UAV has climbed clear of every body."""
        return (
            not self._stays.has_slid
            and position[2] >= ABORT_HEIGHT_M
            and all(gap >= ABORT_CLEAR_M for gap in self._gaps.values())
        )

    def outcome(
        self,
        time_s: float,
        position: Vector,
        attitude: Quaternion,
        velocity: Vector,
        thrust_n: float,
    ) -> Outcome | None:
        """Return "collision", "landed" or "slid" once the contacts at this moment say so.

        ``velocity`` is the one before the contact.
        """
        if not self._airborne and position[2] > AIRBORNE_M:
            self._airborne = True
            self._recorder.event("took_off", "left the ground")
        touches = () if self._nothing_near else self._world.hull_contacts()
        if not touches and self._stays.since_s is None:
            return None
        x, y, _, _ = attitude
        tilt = math.acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y))))
        ground_m = None
        for touch in touches:
            if touch.body == "ground":
                ground_m = touch.position_m if self._airborne else None
            elif self._collides(touch, velocity, tilt):
                self.record_pose(time_s)
                return "collision"
        outcome = self._stays.update(time_s, ground_m, position, velocity, tilt, thrust_n)
        if outcome:
            self.record_pose(time_s)
        return outcome

    def _collides(self, touch: HullContact, velocity: Vector, tilt_rad: float) -> bool:
        """Record the first contact with a body; return whether the contact ends the flight."""
        body, stays = touch.body, self._stays
        if body not in self._touched:
            self._touched.add(body)
            approach = self._approach_mps(body, velocity)
            self._recorder.contact(body, touch.position_m, approach, tilt_rad)
        if stays.has_slid:
            return False
        if stays.motors_stopped and any(npc.name == body for npc in self._npcs):
            stays.was_pushed = True
            return False
        self._gaps[body] = 0.0
        return not stays.was_pushed

    def _approach_mps(self, body: str, velocity: Vector) -> float:
        """Return the UAV's speed relative to a body: a moving one may hit a hovering UAV."""
        moving = next((npc for npc in self._npcs if npc.name == body), None)
        return math.dist(velocity, moving.velocity_mps if moving else (0.0, 0.0, 0.0))
