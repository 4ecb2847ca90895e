"""A stand-in for a landing in the domain `field`: arithmetic instead of physics and pictures.

A search of 400 flights takes seconds, so that parts of a search can be compared over many seeds.
The landing takes off, flies to the told coordinate, reads the marker if it is clear enough, comes
down at one speed and looks at nothing but the marker.  It fails in the ways of `field`: it loses
the marker, lands on a decoy or beside the marker, drifts into what stands beside it, comes down
too fast, slides, is hit.  Most of the ways take two conditions.  Its numbers are estimates; they
were fixed before the first comparison, and nothing that is said of a real landing system comes
from here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.severity import NO_SEVERITY
from pytest_garl.scenarios.groups.decoys import KINDS
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placement import (
    marker_position_m,
    object_altitude_m,
    object_speed_mps,
    object_start_m,
    object_type,
    told_position_m,
)
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import LIMITS_S, Story, story_of
from pytest_garl.verdicts.verdict import Margin, MarginName, PropertyName, Verdict, ViolationType

HIGH_M = 10.0
TAKE_OFF_S = 5.0
CRUISE_MPS = 3.0
DESCENT_MPS = 1.2
STEP_S = 0.1
HULL_M = 0.5
DISTANCE_M, TIME_S = 0.75, 120.0
READABLE, READ = 0.25, 0.45
"""Clearness from which on the marker could be read, and is read by the landing."""
LOSSES = (
    ("environment.dust", 1.0, 1.1),
    ("environment.fog", 1.0, 1.6),
    ("environment.rain", 0.5, 0.7),
    ("environment.road_wetness", 1.0, 0.3),
    ("environment.snow", 0.5, 0.9),
    ("environment.road_snow", 0.45, 0.9),
    ("environment.maple_leaf", 1.0, 0.3),
    ("environment.road_leaf", 0.7, 0.7),
    ("pad.worn_percent", 20.0, 0.6),
    ("camera.dirt_percent", 20.0, 0.6),
    ("camera.exposure_ms", 33.0, 0.6),
)
"""Gene, its largest value, and the optical depth at that value; it grows with the square."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Event:
    """Something that ends the landing: when, its signature, type and property."""

    time_s: float
    signature: str
    type: ViolationType
    property: PropertyName


@dataclass(frozen=True, slots=True, kw_only=True)
class _Way:
    """The way of the UAV: over the told coordinate, to the marker, down."""

    start_m: tuple[float, float]
    told_m: tuple[float, float]
    marker_m: tuple[float, float]
    over_told_s: float
    descends_s: float

    @property
    def lands_s(self) -> float:
        return self.descends_s + HIGH_M / DESCENT_MPS

    @property
    def phases_s(self) -> tuple[float, float, float, float]:
        """When the phases of stories begin."""
        return (
            0.0,
            self.descends_s + (HIGH_M - 8.0) / DESCENT_MPS,
            self.descends_s + (HIGH_M - 3.0) / DESCENT_MPS,
            self.lands_s,
        )

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


def stand_in(scenario: Scenario, map: Map) -> FlightResult:
    """Return the result of a landing in a scenario of `field`."""
    told, marker = told_position_m(scenario, map), marker_position_m(scenario, map)
    told = _moved(told, scenario["told.error_m"], scenario["told.towards_deg"])
    away = math.dist(map.uav_start_m[:2], told)
    over_told_s = TAKE_OFF_S + away / CRUISE_MPS
    rng = np.random.default_rng(scenario.seed)
    searches_s = 2.0 + math.dist(told, marker) + float(rng.uniform(0, 1))
    clear = _clearness(scenario)
    if clear < 0.6:
        searches_s *= 1 + 8 * (0.6 - clear)
    way = _Way(
        start_m=(map.uav_start_m[0], map.uav_start_m[1]),
        told_m=told,
        marker_m=marker,
        over_told_s=over_told_s,
        descends_s=over_told_s + searches_s,
    )
    off_m = _off_m(scenario, way, rng)
    events: list[_Event] = []
    gaps = _bodies(scenario, map, way, events)
    static_m = scenario["pad.clearance_m"] - 0.3 - 0.7 * off_m
    margins: dict[MarginName, float] = {
        "distance": DISTANCE_M - off_m,
        "time": TIME_S - way.lands_s,
        "moving": min([10.0, *(gap for gap, _, _ in gaps)]),
        "static": max(0.0, static_m) if static_m < 3.0 else 3.0,
        "touchdown_speed": 2.0 - _sink_mps(scenario),
        "touchdown_tilt": 0.35 - 0.05 * scenario["wind.turbulence"],
        "dropout": 3.0 - max(0.0, 8 * (0.75 - clear)),
        "decoy": _nearest_decoy_m(scenario, told, marker),
        "tracking": DISTANCE_M - 0.9 * off_m,
        "slide": 0.5 - _slide_m(scenario),
        "crash": 1.0,
    }
    margins["collision"] = min(margins["moving"], margins["static"])
    excused = _on_the_ground(scenario, way, margins, clear, events)
    return _result(way, margins, events, gaps, off_m, excused=excused)


def _moved(place: tuple[float, float], by_m: float, towards_deg: float) -> tuple[float, float]:
    angle = math.radians(towards_deg)
    return place[0] + by_m * math.sin(angle), place[1] + by_m * math.cos(angle)


def _clearness(scenario: Scenario) -> float:
    depth: float = sum(
        most * (scenario.get(key, 0.0) / top) ** 2 for key, top, most in _losses(scenario)
    )
    dark = abs(2 * scenario.get("environment.sun_position", 0.5) - 1)
    return math.exp(-depth - 0.9 * dark**4)


def _losses(scenario: Scenario) -> list[tuple[str, float, float]]:
    known = {key for key, _ in scenario.genes}
    return [each for each in LOSSES if each[0] in known]


def _covers(scenario: Scenario, name: str, way: _Way) -> float:
    """Return for how long an event lasts while the UAV comes down."""
    begins = scenario[f"{name}.from_s"]
    ends = begins + scenario[f"{name}.lasts_s"]
    return max(0.0, min(ends, way.lands_s) - max(begins, way.descends_s))


def _off_m(scenario: Scenario, way: _Way, rng: np.random.Generator) -> float:
    """Return how far from the marker the UAV comes down."""
    wind, late_s = scenario["wind.mean_mps"], scenario["timing.latency_ms"] / 1000
    gust = wind * scenario["wind.turbulence"]
    turned = abs(scenario["camera.mounting_roll_deg"]) + abs(scenario["camera.mounting_pitch_deg"])
    off = 0.05 + 0.02 * turned + 0.02 * gust + 0.3 * late_s * wind
    off += 0.04 * scenario["navigation.tilt_deg"] * (1 + 4 * late_s)
    off += 0.0006 * abs(scenario["timing.stamp_error_ms"]) * wind
    jumps_s = scenario["jump.from_s"]
    if way.phases_s[2] <= jumps_s <= way.lands_s:
        off += 0.5 * scenario["jump.distance_m"]
    off += 0.03 * _covers(scenario, "burst", way) * scenario["burst.latency_ms"] / 1000 * wind
    frozen = scenario["outage.frozen"] >= 0.5
    off += _covers(scenario, "outage", way) * (0.06 * wind + 0.1 * frozen)
    return off + float(rng.uniform(0, 0.05))


def _sink_mps(scenario: Scenario) -> float:
    gust = scenario["wind.mean_mps"] * scenario["wind.turbulence"]
    lifted = scenario["navigation.height_m"] * scenario["navigation.correlation_s"] / 600
    return 0.5 + 0.09 * gust + 0.8 * lifted + 1.5 * scenario["timing.latency_ms"] / 1000


def _slide_m(scenario: Scenario) -> float:
    slippery = scenario.get("environment.road_wetness", 0.0) / 2
    slippery += scenario.get("environment.road_snow", 0.0)
    return 0.02 + 0.15 * slippery * math.pow(max(0.0, scenario["wind.mean_mps"] - 2.0), 1.5)


def _decoys(scenario: Scenario) -> list[tuple[str, tuple[float, float]]]:
    found = []
    for number in (1, 2, 3):
        kind = KINDS[int(scenario[f"decoy-{number}.kind"])]
        place = scenario[f"decoy-{number}.x_m"], scenario[f"decoy-{number}.y_m"]
        found += [(kind, place)] if kind != "none" else []
    return found


def _nearest_decoy_m(
    scenario: Scenario, told: tuple[float, float], marker: tuple[float, float]
) -> float:
    own = math.dist(told, marker)
    gaps = [math.dist((told[0] + x, told[1] + y), told) - own for _, (x, y) in _decoys(scenario)]
    return min([10.0, *gaps])


def _on_the_ground(
    scenario: Scenario,
    way: _Way,
    margins: Mapping[MarginName, float],
    clear: float,
    events: list[_Event],
) -> bool:
    """Add what goes wrong without a moving body; return whether nobody could have landed."""
    lands = way.lands_s
    black_s = 0.0 if scenario["outage.frozen"] >= 0.5 else _covers(scenario, "outage", way)
    hidden_s = _covers(scenario, "cover", way) * (scenario["cover.share_percent"] > 40)
    own = math.dist(way.told_m, way.marker_m)
    for kind, (x, y) in _decoys(scenario):
        nearer = math.hypot(x, y) < own - 1.0
        taken = kind == "same-id-without-margin" or (clear < 0.7 and kind in ("helipad-h", "grate"))
        if nearer and taken:
            events.append(
                _Event(
                    time_s=lands - 0.5,
                    signature=f"I:decoy-{kind}:seen",
                    type="I",
                    property="distance",
                )
            )
    if clear < READ:
        if clear < READABLE:
            return True
        cause = "never-seen" if clear < 0.35 else "lost:search"
        events.append(
            _Event(time_s=way.over_told_s + 30, signature=f"II:{cause}", type="II", property="time")
        )
    elif clear < 0.55 and black_s + hidden_s > 1.0:
        events.append(
            _Event(
                time_s=way.descends_s + 6, signature="II:lost:descent", type="II", property="time"
            )
        )
    elif black_s + hidden_s > 3.5:
        events.append(
            _Event(
                time_s=way.descends_s + 7,
                signature="II:gave-up-in-sight:descent",
                type="II",
                property="time",
            )
        )
    if margins["static"] <= 0:
        kind = "tree" if way.marker_m[0] > 0 else "bench"
        phase = "descent" if margins["distance"] < 0.3 else "last-metre"
        events.append(
            _Event(
                time_s=lands - 1.0,
                signature=f"III:{kind}:{phase}",
                type="III",
                property="collision",
            )
        )
    if margins["distance"] < 0:
        seen = "seen" if clear > 0.7 else "unseen"
        far = margins["distance"] < -0.75
        signature = f"I:nothing:{seen}" if far else f"off:{seen}"
        events.append(
            _Event(
                time_s=lands, signature=signature, type="I" if far else "off", property="distance"
            )
        )
    if margins["touchdown_speed"] < 0:
        events.append(
            _Event(time_s=lands, signature="hard:fast", type="hard", property="collision")
        )
    if margins["slide"] < 0:
        events.append(
            _Event(
                time_s=lands + 0.5, signature="slid:motors-off", type="slid", property="distance"
            )
        )
    return False


def _bodies(
    scenario: Scenario, map: Map, way: _Way, events: list[_Event]
) -> list[tuple[float, str, str]]:
    """Add the contacts; return each body's least gap, the signature of a contact, its name."""
    gaps = []
    for name, _ in map.without(scenario.removed_objects).present_objects:
        story = story_of(scenario, name)
        if story is None or object_speed_mps(scenario, map, name) <= 0:
            continue
        gap, at_s, seen = _least_gap(scenario, map, way, name, story)
        kind = object_type(scenario, map, name).name
        signature = f"IV:{kind}:{way.phase(at_s)}:{'seen' if seen else 'unseen'}"
        gaps.append((max(0.0, gap), signature, name))
        if gap <= 0:
            events.append(_Event(time_s=at_s, signature=signature, type="IV", property="collision"))
    return gaps


def _least_gap(
    scenario: Scenario, map: Map, way: _Way, name: str, story: Story
) -> tuple[float, float, bool]:
    """Return the least gap between the UAV and a body, when it was, and whether it was in view."""
    kind, speed = object_type(scenario, map, name), object_speed_mps(scenario, map, name)
    x, y = object_start_m(scenario, map, name)
    cx, cy = (a + b for a, b in zip(way.marker_m, story.crossing_m, strict=True))
    begins = story.begins_s(way.phases_s)
    middle = object_altitude_m(scenario, map, name)
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


def _result(
    way: _Way,
    margins: Mapping[MarginName, float],
    events: list[_Event],
    gaps: list[tuple[float, str, str]],
    off_m: float,
    *,
    excused: bool,
) -> FlightResult:
    first = min(events, key=lambda each: (each.time_s, each.signature), default=None)
    excused = excused and first is None
    hit = first is not None and first.property == "collision"
    gave_up = excused or (first is not None and first.type == "II")
    outcome = "gave_up" if gave_up else "collision" if hit else "landed"
    if first is not None and first.type == "slid":
        outcome = "slid"
    near = min((each for each in gaps if each[0] < 3.0), default=None)
    if near is None and margins["static"] < 3.0:
        near = margins["static"], "III:tree:descent", "tree-1"
    values = dict(margins)
    if first is not None:
        values["time"] = min(values["time"], 0.0) if first.property == "time" else values["time"]
    verdict = Verdict(
        outcome=outcome,
        primary=first.property if first else None,
        violation_type=first.type if first else None,
        signature=first.signature if first else "",
        paper_violation=first is not None or excused,
        margins=tuple(
            Margin(property=name, value=value, unit="1", decided=not hit)
            for name, value in values.items()
        ),
        story="",
        completed=first is None and not excused,
        excuse="undetectable" if excused else "",
    )
    return FlightResult(
        outcome=outcome,
        final_distance_m=off_m,
        elapsed_s=first.time_s if first else way.lands_s,
        collisions=(near[2],) if hit and near else (),
        undecided="",
        closest_call=near[1] if near else "",
        closest_body=near[2] if near else "",
        verdict=verdict,
        crash=None,
        landed_s=None if gave_up or hit else way.lands_s,
        severity=NO_SEVERITY if first else None,
    )
