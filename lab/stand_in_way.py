"""How good the stand-in of a landing is, its way, and the bodies that it meets on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed, PlacedNpc
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import LIMITS_S, Story
from pytest_garl.verdicts.verdict import PropertyName, ViolationType

HIGH_M = 10.0
TAKE_OFF_S = 5.0
DESCENT_MPS = 1.2
STEP_S = 0.1
HULL_M = 0.5
LOST_BELOW_M = 0.5
"""Below it the marker does not fit into the frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LandingModel:
    """How good the landing is: it reads the marker from the clearness ``read`` on.

    ``drift``, ``sink`` and ``slide`` are shares of what conditions do to :data:`ORDINARY`;
    ``gives_way_m`` is how far it moves away from bodies that it sees, and from others.
    """

    read: float = 0.45
    drift: float = 1.0
    sink: float = 1.0
    slide: float = 1.0
    gives_way_m: tuple[float, float] = (0.0, 0.0)
    follows_decoys: bool = True


ORDINARY = LandingModel()
STURDY = LandingModel(
    read=0.28, drift=0.5, sink=0.8, slide=0.6, gives_way_m=(0.6, 0.3), follows_decoys=False
)
"""A landing that seldom fails: in some 2 % of random scenarios, in place of 12."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that ends the landing: when, its signature, type and property."""

    time_s: float
    signature: str
    type: ViolationType
    property: PropertyName


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """The way of the UAV: over the told coordinate, to the marker, down."""

    start_m: tuple[float, float]
    told_m: tuple[float, float]
    marker_m: tuple[float, float]
    over_told_s: float
    descends_s: float

    @property
    def lands_s(self) -> float:
        """When the UAV touches the ground."""
        return self.descends_s + HIGH_M / DESCENT_MPS

    @property
    def moments_s(self) -> tuple[float, ...]:
        """When the moments of the landing come; the marker is readable as soon as it is near."""
        return (
            0.0,
            self.descends_s + (HIGH_M - 8.0) / DESCENT_MPS,
            self.descends_s + (HIGH_M - 3.0) / DESCENT_MPS,
            self.lands_s,
            self.over_told_s,
            self.lands_s - LOST_BELOW_M / DESCENT_MPS,
        )

    def met_s(self, npc: PlacedNpc) -> float:
        """Return when an NPC can just meet the UAV where that comes down."""
        way_s = math.dist(npc.start_m, self.marker_m) / max(0.1, npc.speed_mps)
        return max(self.descends_s, self.lands_s - npc.type.height_m / DESCENT_MPS - way_s)

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Return where the UAV is."""
        if time_s < TAKE_OFF_S:
            return (*self.start_m, HIGH_M * time_s / TAKE_OFF_S)
        ends, times = (self.start_m, self.told_m), (TAKE_OFF_S, self.over_told_s)
        if time_s > self.over_told_s:
            ends, times = (self.told_m, self.marker_m), (self.over_told_s, self.descends_s)
        share = min(1.0, (time_s - times[0]) / max(1e-6, times[1] - times[0]))
        x, y = (a + share * (b - a) for a, b in zip(*ends, strict=True))
        return x, y, max(0.0, HIGH_M - DESCENT_MPS * max(0.0, time_s - self.descends_s))

    def phase(self, time_s: float) -> str:
        """Return the name of the phase, as signatures say it."""
        height = self.at(time_s)[2]
        if time_s < self.over_told_s:
            return "take-off" if time_s < TAKE_OFF_S else "transit"
        if time_s < self.descends_s:
            return "search"
        return "last-metre" if height < 1.0 else "descent" if height < 8.0 else "approach"


def meet_bodies(
    scenario: Scenario, map: Map, way: Way, events: list[Event], gives_way_m: tuple[float, float]
) -> list[tuple[float, str, str]]:
    """Add the contacts; return each body's least gap, the signature of a contact, its name.

    ``gives_way_m`` is how far the landing moves away from bodies that it sees, and from others.
    """
    gaps = []
    placed = Placed(scenario, map)
    for name, _ in placed.map.present_objects:
        story = placed.npc(name).story
        if story is None or placed.npc(name).speed_mps <= 0:
            continue
        gap, at_s, seen = _least_gap(placed.npc(name), way, story)
        gap += gives_way_m[0] if seen else gives_way_m[1]
        kind = placed.npc(name).type.name
        signature = f"IV:{kind}:{way.phase(at_s)}:{'seen' if seen else 'unseen'}"
        gaps.append((max(0.0, gap), signature, name))
        if gap <= 0:
            events.append(Event(time_s=at_s, signature=signature, type="IV", property="collision"))
    return gaps


def _least_gap(npc: PlacedNpc, way: Way, story: Story) -> tuple[float, float, bool]:
    """Return the least gap between the UAV and a body, when it was, and whether it was in view."""
    kind, speed, (x, y) = npc.type, npc.speed_mps, npc.start_m
    cx, cy = (a + b for a, b in zip(way.marker_m, story.crossing_m, strict=True))
    # In place of the decision of a director: the rule that it has to beat.
    met_s = way.met_s(npc)
    begins = story.begins_s((*way.moments_s, met_s, met_s))
    middle = npc.height_m
    stays_until, met_s, crossed = math.inf, math.inf, False
    best = (10.0, 0.0, False)
    for step in range(round((way.lands_s + 3) / STEP_S)):
        now = step * STEP_S
        ux, uy, uz = way.at(now)
        if now >= begins:
            if story.grade == "careless":
                tx, ty = (cx, cy) if not crossed else (2 * cx - x, 2 * cy - y)
                if not crossed and math.dist((x, y), (cx, cy)) < speed * STEP_S + 0.05:
                    crossed, stays_until = True, now + story.pause_s
                going = not crossed or now >= stays_until
                tx, ty = (tx, ty) if not crossed else (cx + 30.0, cy)
            else:
                sees = math.dist((x, y, 1.0), (ux, uy, uz)) < (
                    10 if story.grade == "curious" else 20
                )
                met_s = min(met_s, now) if sees else met_s
                over = now > met_s + min(story.lasts_s, LIMITS_S[story.grade])
                tx, ty = (x + 30.0, y) if over else (ux, uy) if sees else way.marker_m
                keeps = 2.0 if story.grade == "curious" and not kind.flies else 0.0
                going = over or math.dist((x, y), (tx, ty)) > max(keeps, 0.1)
            left = math.dist((x, y), (tx, ty))
            if going and left > 1e-6:
                share = min(1.0, speed * STEP_S / left)
                x, y = x + share * (tx - x), y + share * (ty - y)
        low = middle - (story.stoop_m if kind.flies else 0.0) + kind.low_m
        low = max(1.0, low) if kind.flies else 0.0
        above = max(0.0, uz - (low + kind.height_m), low - uz - 0.5)
        gap = max(math.dist((x, y), (ux, uy)) - kind.radius_m - HULL_M, above)
        if gap < best[0]:
            best = gap, now, speed < 2.5 or uz > 3
    return best
