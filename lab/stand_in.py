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

import numpy as np

from lab.stand_in_way import ORDINARY, TAKE_OFF_S, Event, LandingModel, Way, meet_bodies
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.severity import NO_SEVERITY
from pytest_garl.scenarios.groups import DECOY_KINDS, MOMENTS, QUANTITIES
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import Margin, MarginName, Verdict

CRUISE_MPS = 3.0
DISTANCE_M, TIME_S = 0.75, 120.0
READABLE = 0.25
"""Clearness from which on the marker could be read."""
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


def way_of(scenario: Scenario, map: Map, rng: np.random.Generator) -> Way:
    """Return the way of a landing in a scenario of `field`; no event changes it."""
    placed = Placed(scenario, map)
    told, marker = placed.told_m, placed.marker_m
    told = _moved(told, scenario["told.error_m"], scenario["told.towards_deg"])
    away = math.dist(map.uav_start_m[:2], told)
    over_told_s = TAKE_OFF_S + away / CRUISE_MPS
    searches_s = 2.0 + math.dist(told, marker) + float(rng.uniform(0, 1))
    clear = _clearness(scenario)
    if clear < 0.6:
        searches_s *= 1 + 8 * (0.6 - clear)
    return Way(
        start_m=(map.uav_start_m[0], map.uav_start_m[1]),
        told_m=told,
        marker_m=marker,
        over_told_s=over_told_s,
        descends_s=over_told_s + searches_s,
    )


def stand_in(scenario: Scenario, map: Map, landing: LandingModel = ORDINARY) -> FlightResult:
    """Return the result of a landing in a scenario of `field`."""
    rng = np.random.default_rng(scenario.seed)
    way, clear = way_of(scenario, map, rng), _clearness(scenario)
    off_m = landing.drift * _off_m(scenario, way, rng)
    events: list[Event] = []
    gaps = meet_bodies(scenario, map, way, events, landing.gives_way_m)
    static_m = scenario["pad.clearance_m"] - 0.3 - 0.7 * off_m
    margins: dict[MarginName, float] = {
        "distance": DISTANCE_M - off_m,
        "time": TIME_S - way.lands_s,
        "moving": min([10.0, *(gap for gap, _, _ in gaps)]),
        "static": max(0.0, static_m) if static_m < 3.0 else 3.0,
        "touchdown_speed": 2.0 - landing.sink * _sink_mps(scenario),
        "touchdown_tilt": 0.35 - 0.05 * scenario["wind.turbulence"],
        "dropout": 3.0 - max(0.0, 8 * (0.75 - clear)),
        "decoy": _nearest_decoy_m(scenario, way) if landing.follows_decoys else 10.0,
        "tracking": DISTANCE_M - 0.9 * off_m,
        "slide": 0.5 - landing.slide * _slide_m(scenario),
        "crash": 1.0,
    }
    margins["collision"] = min(margins["moving"], margins["static"])
    excused = _on_the_ground(scenario, way, margins, clear, events, landing)
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


def _begins_s(scenario: Scenario, name: str, way: Way) -> float:
    """Return when an event begins; one that waits for a decision by the fixed rule, at 3 m."""
    if name in scenario.decided_events:
        return way.moments_s[MOMENTS.index("3 m")]
    moment = int(QUANTITIES[f"{name}.after"].flown(scenario[f"{name}.after"]))
    return way.moments_s[moment] + scenario[f"{name}.from_s"]


def _covers(scenario: Scenario, name: str, way: Way) -> float:
    """Return for how long an event lasts while the UAV comes down."""
    begins = _begins_s(scenario, name, way)
    ends = begins + scenario[f"{name}.lasts_s"]
    return max(0.0, min(ends, way.lands_s) - max(begins, way.descends_s))


def _off_m(scenario: Scenario, way: Way, rng: np.random.Generator) -> float:
    """Return how far from the marker the UAV comes down."""
    wind, late_s = scenario["wind.mean_mps"], scenario["timing.latency_ms"] / 1000
    gust = wind * scenario["wind.turbulence"]
    turned = abs(scenario["camera.mounting_roll_deg"]) + abs(scenario["camera.mounting_pitch_deg"])
    off = 0.05 + 0.02 * turned + 0.02 * gust + 0.3 * late_s * wind
    off += 0.04 * scenario["navigation.tilt_deg"] * (1 + 4 * late_s)
    off += 0.0006 * abs(scenario["timing.stamp_error_ms"]) * wind
    if way.moments_s[2] <= _begins_s(scenario, "jump", way) <= way.lands_s:
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
        kind = DECOY_KINDS[int(scenario[f"decoy-{number}.kind"])]
        place = scenario[f"decoy-{number}.x_m"], scenario[f"decoy-{number}.y_m"]
        found += [(kind, place)] if kind != "none" else []
    return found


def _nearest_decoy_m(scenario: Scenario, way: Way) -> float:
    own = math.dist(way.told_m, way.marker_m)
    gaps = [
        math.dist((way.told_m[0] + x, way.told_m[1] + y), way.told_m) - own
        for _, (x, y) in _decoys(scenario)
    ]
    return min([10.0, *gaps])


def _on_the_ground(
    scenario: Scenario,
    way: Way,
    margins: Mapping[MarginName, float],
    clear: float,
    events: list[Event],
    landing: LandingModel,
) -> bool:
    """Add what goes wrong without a moving body; return whether nobody could have landed."""
    lands = way.lands_s
    black_s = 0.0 if scenario["outage.frozen"] >= 0.5 else _covers(scenario, "outage", way)
    hidden_s = _covers(scenario, "cover", way) * (scenario["cover.share_percent"] > 40)
    own = math.dist(way.told_m, way.marker_m)
    for kind, (x, y) in _decoys(scenario) if landing.follows_decoys else ():
        nearer = math.hypot(x, y) < own - 1.0
        taken = kind == "same-id-without-margin" or (clear < 0.7 and kind in ("helipad-h", "grate"))
        if nearer and taken:
            events.append(
                Event(
                    time_s=lands - 0.5,
                    signature=f"I:decoy-{kind}:seen",
                    type="I",
                    property="distance",
                )
            )
    if clear < landing.read:
        if clear < READABLE:
            return True
        cause = "never-seen" if clear < 0.35 else "lost:search"
        events.append(
            Event(time_s=way.over_told_s + 30, signature=f"II:{cause}", type="II", property="time")
        )
    elif clear < 0.55 and black_s + hidden_s > 1.0:
        events.append(
            Event(
                time_s=way.descends_s + 6, signature="II:lost:descent", type="II", property="time"
            )
        )
    elif black_s + hidden_s > 3.5:
        events.append(
            Event(
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
            Event(
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
            Event(
                time_s=lands, signature=signature, type="I" if far else "off", property="distance"
            )
        )
    if margins["touchdown_speed"] < 0:
        events.append(Event(time_s=lands, signature="hard:fast", type="hard", property="collision"))
    if margins["slide"] < 0:
        events.append(
            Event(time_s=lands + 0.5, signature="slid:motors-off", type="slid", property="distance")
        )
    return False


def _result(
    way: Way,
    margins: Mapping[MarginName, float],
    events: list[Event],
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
