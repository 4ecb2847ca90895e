"""The decision module: what to do next, from what was seen; no pixels and no motors here."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from pytest_garl import Detection, Diagnostics, Mission

Phase = Literal[
    "take-off", "transit", "search", "confirm", "approach", "descend", "commit", "regain", "abort"
]
GroundPoint = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class DecisionParameters:
    """Every constant of the decision, with its reason."""

    min_confidence: float = 0.8
    """The paper's published systems accept a detection from 0.8."""
    confirm_count: int = 4
    confirm_window: int = 8
    confirm_radius_m: float = 0.7
    """Four of eight frames that agree within 0.7 m, the paper's retarget distance."""
    smoothing: float = 0.35
    """Weight of a new estimate: three frames to follow, enough to average corner noise."""
    retarget_m: float = 1.5
    """A detection farther from the target than this is another thing, not noise."""
    cone: float = 0.25
    cone_floor_m: float = 0.20
    """Descend only within 0.2 m plus a quarter of the height of the marker's axis."""
    commit_share: float = 9 / 14
    """Where the marker with its white margin would cover more of the frame's short side than this,
    it no longer surely fits: land on the estimate, and go on improving it while the marker is in
    sight.  A marker of 1.5 m fits down to 2 m with a camera that covers 1.5 m from 1 m."""
    least_commit_height_m: float = 0.5
    """However small the marker is: lower, the downwash from the ground shakes the UAV."""
    commit_offset_m: float = 0.3
    confirm_patience_s: float = 3.0
    """How long to fly towards a fleeting sighting before going on with the search."""
    fresh_s: float = 1.0
    """Descend through gaps of up to a second: at 1.2 m/s the estimate is still good."""
    lost_hold_s: float = 4.0
    """PLND_TIMEOUT's default: hold before climbing to look again."""
    regain_climb_m: float = 3.0
    max_retries: int = 4
    """PLND_RET_MAX's default."""
    abort_reserve_s: float = 12.0
    """Time kept to climb away before the mission's limit."""
    search_radius_m: float = 7.5
    """How far the marker may lie from the told coordinate: see ``Mission``."""
    search_step: float = 0.3
    """From one point of the search to the next, as a share of what the frame's short side covers:
    each place is shown three times, and once near the middle."""
    arrive_m: float = 0.6
    pass_m: float = 1.5
    """Points of the search are passed by, not stopped at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """A decision: a phase, a goal (x, y), a height, and a reason in words."""

    phase: Phase
    goal_m: tuple[float, float, float]
    target_m: GroundPoint | None
    note: str = ""

    def diagnostics(
        self,
        seen: tuple[Detection, ...],
        *,
        path: tuple[tuple[float, float, float], ...] = (),
        note: str = "",
        obstacles: tuple[tuple[float, float, float], ...] | None = None,
    ) -> Diagnostics:
        """Return the decision for the flight's record, with what it was made from."""
        return Diagnostics(
            phase=self.phase,
            detections=seen,
            target_m=(*self.target_m, 0.0) if self.target_m else None,
            planned_path_m=path,
            note=note or self.note,
            obstacles_m=obstacles,
        )


class DecisionModule:
    """The landing's state machine; feed it every frame's detections."""

    def __init__(self, mission: Mission, parameters: DecisionParameters | None = None) -> None:
        self._mission = mission
        self._p = parameters or DecisionParameters()
        self._phase: Phase = "take-off"
        self._target: GroundPoint | None = None
        self._seen_at = 0.0
        self._recent: deque[GroundPoint | None] = deque(maxlen=self._p.confirm_window)
        self._retries = 0
        self._regain_height = mission.search_altitude_m
        self._searched: list[GroundPoint] = []
        self._candidate: GroundPoint | None = None
        self._candidate_at = 0.0
        camera = mission.camera
        self._short_side = min(camera.width_px, camera.height_px) / camera.focal_px
        """What the frame's short side covers from a height of 1 m, in m."""
        margin_m = mission.marker_side_m * 9 / 7
        fits_m = margin_m / (self._short_side * self._p.commit_share)
        self._commit_height_m = max(self._p.least_commit_height_m, fits_m)

    def decide(
        self,
        time_s: float,
        position_m: tuple[float, float, float],
        seen: Iterable[Detection] | None,
    ) -> Decision:
        """Return what to do after a frame seen at ``position_m``.

        ``seen`` is None for a frame in which the detector has not looked.
        """
        mission, p = self._mission, self._p
        x, y, z = position_m
        if seen is not None:
            self._note_sight(time_s, self._spot(seen))
        if time_s > mission.time_limit_s - p.abort_reserve_s and self._phase != "commit":
            return self._go("abort", position_m, "no time is left for another try")
        if self._phase == "take-off":
            if z < mission.search_altitude_m - 1.0:
                return self._go("take-off", (x, y, mission.search_altitude_m))
            self._phase = "transit"
        if self._phase in ("transit", "search", "confirm"):
            return self._look(time_s, position_m)
        return self._land(time_s, position_m)

    def interrupt(self) -> None:
        """Take a commitment to land back: something is in the way."""
        if self._phase == "commit":
            self._phase = "approach"

    def _spot(self, seen: Iterable[Detection]) -> GroundPoint | None:
        """Pick the detection of the wanted marker, the one nearest to the target if several."""
        good = [
            (item.position_m[0], item.position_m[1])
            for item in seen
            if item.marker_id == self._mission.marker_id
            and item.confidence >= self._p.min_confidence
        ]
        if not good:
            return None
        anchor = self._target or self._mission.gps_position_m
        return min(good, key=lambda place: math.dist(place, anchor))

    def _note_sight(self, time_s: float, spot: GroundPoint | None) -> None:
        self._recent.append(spot)
        if spot is None:
            return
        if self._target is None:
            self._candidate, self._candidate_at = spot, time_s
            return
        if math.dist(spot, self._target) <= self._p.retarget_m:
            share = self._p.smoothing
            self._target = (
                self._target[0] + share * (spot[0] - self._target[0]),
                self._target[1] + share * (spot[1] - self._target[1]),
            )
            self._seen_at = time_s
        elif self._agreed() is not None:
            self._target, self._seen_at = self._agreed(), time_s

    def _agreed(self) -> GroundPoint | None:
        """Return the middle of the recent sightings if enough of them agree."""
        places = [place for place in self._recent if place is not None]
        if len(places) < self._p.confirm_count:
            return None
        latest = places[-1]
        near = [place for place in places if math.dist(place, latest) <= self._p.confirm_radius_m]
        if len(near) < self._p.confirm_count:
            return None
        x = y = 0.0
        for place in near:
            x, y = x + place[0], y + place[1]
        return x / len(near), y / len(near)

    def _look(self, time_s: float, position: tuple[float, float, float]) -> Decision:
        mission, p = self._mission, self._p
        x, y, _z = position
        agreed = self._agreed()
        if agreed is not None:
            self._target, self._seen_at = agreed, self._candidate_at
            return self._go("approach", (*agreed, mission.search_altitude_m), "marker confirmed")
        if self._candidate is not None and time_s - self._candidate_at < p.confirm_patience_s:
            # Something was seen: go and look at it from above before going on.
            return self._go("confirm", (*self._candidate, mission.search_altitude_m))
        if not self._searched:
            gps_x, gps_y = mission.gps_position_m
            if math.dist((x, y), (gps_x, gps_y)) > p.arrive_m:
                return self._go("transit", (gps_x, gps_y, mission.search_altitude_m))
            self._searched = self._pattern()
        if math.dist((x, y), self._searched[0]) < p.pass_m:
            self._searched.pop(0)
            if not self._searched:
                return self._go("abort", position, "the marker was not found")
        return self._go("search", (*self._searched[0], mission.search_altitude_m))

    def _pattern(self) -> list[GroundPoint]:
        """Rings about the given GPS position, out to the largest distance of the marker."""
        gps_x, gps_y = self._mission.gps_position_m
        step_m = self._p.search_step * self._short_side * self._mission.search_altitude_m
        rings = math.ceil(self._p.search_radius_m / step_m)
        places = []
        for ring in range(1, rings + 1):
            radius = self._p.search_radius_m * ring / rings
            count = math.ceil(2 * math.pi * radius / step_m)
            for index in range(count + 1):
                angle = 2 * math.pi * index / count
                places.append((gps_x + radius * math.cos(angle), gps_y + radius * math.sin(angle)))
        return places

    def _land(self, time_s: float, position: tuple[float, float, float]) -> Decision:
        p = self._p
        x, y, z = position
        target = self._target or (x, y)
        offset = math.dist((x, y), target)
        unseen_s = time_s - self._seen_at
        if self._phase == "commit":
            return self._go("commit", (*target, 0.0))
        if self._phase == "regain":
            if unseen_s < 0.3:
                self._phase = "approach"
            elif z < self._regain_height - 0.5:
                return self._go("regain", (*target, self._regain_height), "climbing to see again")
            elif unseen_s > 2 * p.lost_hold_s + 4.0:
                return self._give_up(position)
            else:
                return self._go("regain", (*target, self._regain_height))
        if unseen_s > p.lost_hold_s:
            self._retries += 1
            if self._retries > p.max_retries:
                return self._go("abort", position, "the marker was lost too often")
            self._seen_at = time_s - p.lost_hold_s
            self._regain_height = min(self._mission.search_altitude_m, z + p.regain_climb_m)
            return self._go("regain", (*target, self._regain_height), "marker lost")
        inside = offset <= p.cone_floor_m + p.cone * z
        fresh = unseen_s < p.fresh_s
        if z <= self._commit_height_m and offset <= p.commit_offset_m and fresh:
            return self._go("commit", (*target, 0.0), "below the height at which the marker fits")
        if inside and fresh and z > self._commit_height_m:
            return self._go("descend", (*target, self._commit_height_m - 0.2))
        if inside and fresh:
            return self._go("descend", (*target, z))
        return self._go("approach", (*target, z), "" if fresh else "marker out of sight, holding")

    def _give_up(self, position: tuple[float, float, float]) -> Decision:
        """Forget a target that is not there any more and search again, while retries last."""
        self._retries += 1
        if self._retries > self._p.max_retries:
            return self._go("abort", position, "the marker was not found again")
        self._target = self._candidate = None
        self._recent.clear()
        self._recent.append(None)
        self._searched = self._pattern()
        return self._go("search", (*self._searched[0], self._mission.search_altitude_m))

    def _go(self, phase: Phase, goal: tuple[float, float, float], note: str = "") -> Decision:
        self._phase = phase
        return Decision(phase=phase, goal_m=goal, target_m=self._target, note=note)
