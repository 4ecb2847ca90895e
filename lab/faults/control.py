"""The control of the fault suite: a landing system without a planted fault.

It climbs, flies to the told coordinate, searches in rings, confirms the pad, descends above it, and
commits where the marker no longer fits into the picture.  It gives way to what stands or moves
below, climbs to look again for a pad that it has lost, and gives up in time.  It keeps the heading
of the start.  Each part that a fault changes is a method, a parameter or a class attribute.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from lab.faults.eyes import Eyes
from lab.faults.track import Place, Track
from lab.faults.watch import Watch
from pytest_garl import (
    Abort,
    Airframe,
    Command,
    Detection,
    Diagnostics,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """The constants of the control."""

    transit_mps: float = 4.0
    approach_mps: float = 2.0
    descend_mps: float = 1.2
    final_mps: float = 0.7
    final_height_m: float = 3.0
    land_mps: float = 0.5
    land_height_m: float = 0.3
    centring_gain: float = 0.9
    most_centring_mps: float = 1.0
    cone_m: float = 0.2
    cone: float = 0.25
    """It descends within 0.2 m and a quarter of the height of the pad's axis."""
    commit_height_m: float = 2.0
    """Lower, a marker of 1.5 m with its margin no longer surely fits into the picture."""
    commit_offset_m: float = 0.3
    fresh_s: float = 1.0
    """It descends through gaps of a second."""
    hold_s: float = 4.0
    """It holds for so long before it climbs to look again: ArduPilot's default."""
    forget_s: float = 12.0
    """A pad that was lost for so long is searched for anew."""
    most_retries: int = 4
    clear_s: float = 1.0
    """Nothing must have been in the way for so long before a descent goes on."""
    margin_m: float = 0.3
    """It makes way only below the height of the search less this; there it waits."""
    patience_s: float = 45.0
    """It waits so long in all for a pad that is not free."""
    reserve_s: float = 12.0
    search_m: float = 7.5
    ring_m: float = 3.75
    pass_m: float = 1.5
    hint_s: float = 3.0


class ControlSystem:
    """A landing system that lands in most scenarios of the domain ``field``."""

    airframe = Airframe()
    parameters = Parameters()
    eyes_of: Callable[[Mission], Eyes] = Eyes
    track_of: Callable[[], Track] = Track
    watch_of: Callable[[Mission], Watch] = Watch

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        self.mission = mission
        self.eyes = type(self).eyes_of(mission)
        self.track = type(self).track_of()
        self.watch = type(self).watch_of(mission)
        self.phase = "climb"
        self.top_m = mission.search_altitude_m
        self.blocked_s = -math.inf
        self.waited_s = self.stepped_s = 0.0
        self.retries = 0
        self.rings: list[Place] = []
        self.refuge: Place | None = None

    def step(self, observation: Observation) -> Command:
        """See, decide, command."""
        now = observation.time_s
        x, y, z = (float(value) for value in observation.position_m)
        seen = self.eyes.look(observation)
        self.track.note(now, self.chosen(seen))
        if self.phase != "climb" and self.watch.in_the_way(observation):
            self.blocked_s = now
        since, self.stepped_s = now - self.stepped_s, now
        command = self.decide(now, (x, y, z), since)
        target = self.track.target
        told = Diagnostics(
            phase=self.phase, detections=seen, target_m=(*target, 0.0) if target else None
        )
        return _with(command, told)

    def chosen(self, seen: tuple[Detection, ...]) -> Place | None:
        """Return the place of the detection nearest to the target, or to the told coordinate."""
        places = [(each.position_m[0], each.position_m[1]) for each in seen]
        anchor = self.track.target or self.mission.gps_position_m
        return min(places, key=lambda place: math.dist(place, anchor), default=None)

    def decide(self, now: float, at: Vector, since_s: float) -> Command:
        """Return the command for a moment at a place, ``since_s`` after the last one."""
        p, z = self.parameters, at[2]
        late = now > self.mission.time_limit_s - p.reserve_s and self.phase != "commit"
        if late or self.waited_s > p.patience_s or self.retries > p.most_retries:
            return self.give_up()
        if self.phase == "climb":
            if z < self.top_m - 1.0:
                return self.climb(at)
            self.phase = "transit"
        target = self.track.target
        if target is not None and self.must_wait(now, at, target):
            self.waited_s += since_s
            return self.give_way(at, target)
        self.refuge = None
        if target is None:
            return self.search(now, at)
        if self.phase in ("transit", "search", "avoid"):
            self.phase = "approach"
        return self.land(now, at, target)

    def must_wait(self, now: float, at: Vector, target: Place) -> bool:
        """Whether something is in the way of a descent that goes on or would begin."""
        if now - self.blocked_s >= self.parameters.clear_s:
            return False
        return at[2] < self.top_m - self.parameters.margin_m or self.is_inside(at, target)

    def is_inside(self, at: Vector, target: Place) -> bool:
        """Whether it is near enough to the pad's axis to descend."""
        p = self.parameters
        return math.dist(at[:2], target) <= p.cone_m + p.cone * at[2]

    def climb(self, at: Vector) -> Command:
        """Go straight up to the height of the search."""
        return PositionSetpoint(position_m=(at[0], at[1], self.top_m), yaw_rad=None)

    def search(self, now: float, at: Vector) -> Command:
        """Fly to the told coordinate, then in rings around it; look at what was glimpsed."""
        p, here = self.parameters, (at[0], at[1])
        if self.track.hint is not None and now - self.track.hint_s < p.hint_s:
            return self.go(self.track.hint, self.top_m, p.approach_mps)
        if self.phase in ("climb", "transit", "avoid", "approach"):
            self.phase = "transit"
            if math.dist(here, self.mission.gps_position_m) > p.pass_m / 2:
                return self.go(self.mission.gps_position_m, self.top_m, p.transit_mps)
            self.phase, self.rings = "search", self.places()
        if self.rings and math.dist(here, self.rings[0]) < p.pass_m:
            self.rings.pop(0)
        if not self.rings:
            return self.not_found(at)
        return self.go(self.rings[0], self.top_m, p.transit_mps)

    def places(self) -> list[Place]:
        """Return the points of two rings around the told coordinate."""
        p, (x, y) = self.parameters, self.mission.gps_position_m
        found = []
        for radius in (p.ring_m, p.search_m):
            count = math.ceil(math.tau * radius / p.ring_m)
            for index in range(count + 1):
                turn = math.tau * index / count
                found.append((x + radius * math.cos(turn), y + radius * math.sin(turn)))
        return found

    def not_found(self, at: Vector) -> Command:
        """Give up after a search without a pad."""
        return self.give_up()

    def land(self, now: float, at: Vector, target: Place) -> Command:
        """Approach the pad, descend above it, commit; or look for it again."""
        p, (x, y, z) = self.parameters, at
        offset, unseen_s = math.dist((x, y), target), now - self.track.seen_s
        if self.phase == "commit":
            return self.sink(at, target, p.land_mps)
        if unseen_s > p.hold_s:
            return self.regain(now, at, target, unseen_s)
        inside = self.is_inside(at, target)
        fresh = self.may_descend(unseen_s)
        if z <= p.commit_height_m and offset <= p.commit_offset_m and fresh:
            self.phase = "commit"
            return self.sink(at, target, p.land_mps)
        if not (inside and fresh):
            self.phase = "approach"
            return self.go(target, z, p.approach_mps)
        self.phase = "descend"
        rate = p.descend_mps if z > p.final_height_m else p.final_mps
        low = p.commit_height_m - 0.2
        return self.sink(at, target, min(rate, max(0.0, z - low)))

    def may_descend(self, unseen_s: float) -> bool:
        """Whether the pad was seen recently enough to descend."""
        return unseen_s < self.parameters.fresh_s

    def regain(self, now: float, at: Vector, target: Place, unseen_s: float) -> Command:
        """Climb above the lost pad; forget it if it does not come back."""
        p = self.parameters
        if self.phase != "regain":
            self.phase, self.retries = "regain", self.retries + 1
        if unseen_s > p.forget_s:
            self.track.forget()
            self.phase = "transit"
            return self.search(now, at)
        return self.go(target, self.top_m, p.approach_mps)

    def give_way(self, at: Vector, target: Place) -> Command:
        """Climb straight up, where it came from, and wait above the pad."""
        self.phase = "avoid"
        self.refuge = self.refuge or (at[0], at[1])
        is_up = at[2] > self.top_m - self.parameters.margin_m
        return self.go(target if is_up else self.refuge, self.top_m, 2.5)

    def give_up(self) -> Command:
        """Say that the landing is given up."""
        self.phase = "abort"
        return Abort()

    def go(self, place: Place, height_m: float, speed_mps: float) -> Command:
        """Fly to a place."""
        return PositionSetpoint(position_m=(*place, height_m), speed_mps=speed_mps, yaw_rad=None)

    def sink(self, at: Vector, target: Place, rate_mps: float) -> Command:
        """Descend above the target; near the ground say so."""
        p, (x, y, z) = self.parameters, at
        if self.phase == "commit" and z < p.land_height_m:
            return self.touch_down(rate_mps)
        vx, vy = self.centring((target[0] - x, target[1] - y))
        return VelocitySetpoint(velocity_mps=(vx, vy, -rate_mps), yaw_rad=None)

    def touch_down(self, rate_mps: float) -> Command:
        """Descend the last decimetres."""
        return Land(speed_mps=rate_mps)

    def centring(self, offset_m: Place) -> Place:
        """Return the horizontal velocity towards a target."""
        p = self.parameters
        most = p.most_centring_mps
        vx, vy = (max(-most, min(most, p.centring_gain * each)) for each in offset_m)
        return vx, vy


def _with(command: Command, told: Diagnostics) -> Command:
    """Return the command with diagnostics."""
    return replace(command, diagnostics=told)
