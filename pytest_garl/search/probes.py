"""Probes: scenarios with one cause each, flown before a search.

Each differs from the flight in clear air, its twin, by one change, so that a failure is understood
without shrinking.  They find in seconds what a search finds by chance: many landing systems that
people publish take the first marker of a detector's list whatever its id, take a default of zero
for a measurement that is not there yet, or go on with the last error when the marker is lost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.flight.detectability import READABLE, readable_probability
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.bodies import discs_of
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain import Domain
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.groups import DECOY_KINDS, DECOY_REACH_M
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed, marker_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Task
from pytest_garl.scenarios.validity import problems, repair
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.true_camera import looks_at, true_camera
from pytest_garl.simulation.landing_moments import LandingMoments
from pytest_garl.simulation.nominal import LEVEL
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.verdict import Limits, Verdict
from pytest_garl.verdicts.wording import compass_point, headline

SEED = 1
"""Seed of all probes: of the noise of the sensors, which their twin has too."""
GONE_S = 60.0
"""A marker is gone for this time: the longest cover that a scenario can have."""
BACK_AFTER_S = 3.0
"""ArduPilot's AC_PrecLand loses a landing target after 2 s, PX4 (PLD_BTOUT) after 5 s."""
BESIDE_M = 4.0
"""How far from the marker a flight starts or arrives: the default camera sees it from 10 m."""
SEEN_FROM = 0.4
"""The same as a share of the height, for a UAV that holds its place."""
WIND_MPS = 5.0
"""Half of what the Matrice 100 resists by its data sheet."""
AIRS = ((0.75, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0))
"""Fog and dust, as shares of the thickest ones."""
HEIGHTS = 10
"""Heights at which it is asked from where a marker can be read."""
FAR_M = 2.0
"""Of a marker that is nearer when it is first readable there is no half way."""
EARLIER_S = 1.0
"""Half way comes this much before half height, or both are one moment."""
FARTHEST_VIEW, NEAREST_VIEW = 0.8, 0.2
"""A marker is readable low only if it is not from this share of the height on, but from the other.
"""

_EXCUSED = ", excused"
"""What a verdict says in its first sentence of a landing that was given up with an excuse."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Probe:
    """One scenario with one cause.

    ``name`` is its name in items, ``sentence`` what is not as in the flight in clear air.  Where
    landing may be given up (``may_give_up``), not to land is right, and to land off is not.
    ``outside`` says which of its values the domain does not have: such a probe is a note.
    """

    name: str
    sentence: str
    scenario: Scenario
    may_give_up: bool = False
    outside: tuple[str, ...] = ()

    def is_violated(self, verdict: Verdict) -> bool:
        """Whether a flight of the probe violates what may be asked in it."""
        has_not_landed = verdict.primary in ("time", "abort")
        return verdict.violation and not (self.may_give_up and has_not_landed)

    def ending(self, verdict: Verdict) -> str:
        """Return how its flight ended in half a line.

        Where landing may be given up, nothing is said of an excuse: a verdict asks whether anybody
        could have landed before it was given up, and the marker may be back later.
        """
        text = headline(verdict.story)
        if self.may_give_up and verdict.excuse:
            text = text.replace(_EXCUSED, "", 1)
        return text


def clear_scenario(map: Map, task: Task, domain: Domain) -> Scenario:
    """Return the mildest scenario of a domain without NPCs: the twin of all probes."""
    genome = genome_of(domain, map, task)
    return without_objects(
        repair(decode(genome.nominal, genome, map=map.name, seed=SEED), map), map
    )


def without_objects(scenario: Scenario, map: Map) -> Scenario:
    """Return the scenario without the NPCs of its map."""
    names = {name for name, _ in map.all_objects} - {*scenario.removed_objects}
    return scenario.without(*sorted(names))


def probed_map(maps: Sequence[Map]) -> Map:
    """Return the map of a test on which its probes are flown.

    Of those without other markers it is the first by name: plugins shuffle tests, and so maps.
    """
    plain = [each for each in maps if all(layer.kind != "marker" for layer in each.ground.layers)]
    return min(plain or maps, key=lambda each: each.name)


def start_beside(clear: Scenario, map: Map, domain: Domain) -> Probe:
    """Return the probe whose flight is the twin of the others if it lands.

    Its marker lies where blind landings do not end, and as free of obstacles as can be.
    """
    away_m = _away_m(clear, domain)
    sides = ((0.0, away_m), (0.0, -away_m))
    return _start_probe("start-beside", clear, map, domain, sides)


def _away_m(scenario: Scenario, domain: Domain) -> float:
    """Return how far from the marker a flight starts or arrives.

    In a domain of surveyed pads that is at most the error of the mission's coordinate there.  A UAV
    that holds its place is not farther away than its camera sees.
    """
    start, (_, farthest) = scenario.task.start, domain.range_of("told.error_m") or (0.0, 0.0)
    away_m = min(BESIDE_M, SEEN_FROM * start.height_m) if start.holds else BESIDE_M
    return min(away_m, farthest) if scenario["told.surveyed"] >= 0.5 else away_m


def probes_for(
    twin: Flight, scenario: Scenario, map: Map, domain: Domain, limits: Limits, camera: Camera
) -> tuple[Probe, ...]:
    """Return the other probes of a landing system that landed in a scenario, in flight ``twin``.

    Moments and heights come from that flight: until the event strikes, the path is the same.
    """
    made = (
        *_hidden(twin, domain),
        *_other_markers(twin, scenario, map, limits),
        *_thick_air(twin, scenario, map, camera),
        *_wind(scenario, domain),
    )
    found = [
        _probe(name, sentence, scenario.replace(values), map, domain, may_give_up=may_give_up)
        for name, sentence, values, may_give_up in made
    ]
    return (*found, *_starts(scenario, map, domain))


def _probe(
    name: str,
    sentence: str,
    scenario: Scenario,
    map: Map,
    domain: Domain,
    *,
    may_give_up: bool = False,
) -> Probe:
    """Return a probe of a scenario, which is repaired.

    When a cover comes is no condition of the domain: it is when this landing system is at half
    height.  Nor is, where nobody has to land, how long it stays, if the domain has covers at all.
    """
    scenario = repair(scenario, map)
    free = {"cover.from_s": 0.0}
    if may_give_up and domain.range_of("cover.share_percent"):
        free["cover.lasts_s"] = 0.0
    outside = domain.outside(scenario.replace(free), map)
    return Probe(
        name=name, sentence=sentence, scenario=scenario, may_give_up=may_give_up, outside=outside
    )


_Made = Iterator[tuple[str, str, Mapping[str, float], bool]]
"""Name, sentence, the values that change, and whether a landing may be given up."""


def _hidden(twin: Flight, domain: Domain) -> _Made:
    """Yield probes in which something lies over the marker: always, or from a moment on."""
    half_s, half_m = _half_height(twin)
    _, longest_s = domain.range_of("cover.lasts_s") or (0.0, BACK_AFTER_S)
    back_s = min(BACK_AFTER_S, longest_s)
    yield "no-marker", "no marker is there for a minute", _cover(0.0, GONE_S), True
    near = _half_way(twin)
    if near is not None and near[0] < half_s - EARLIER_S:
        early = f"from {near[0]:.1f} s on, {near[1]:.1f} m away, the marker is gone for a minute"
        yield "marker-gone-early", early, _cover(near[0], GONE_S), True
    when = f"from {half_s:.1f} s on, {half_m:.1f} m up,"
    yield "marker-gone", f"{when} the marker is gone for a minute", _cover(half_s, GONE_S), True
    back = f"{when} the marker is gone, and back after {back_s:g} s"
    yield "marker-back", back, _cover(half_s, back_s), False


def _cover(from_s: float, lasts_s: float) -> Mapping[str, float]:
    return {"cover.from_s": from_s, "cover.lasts_s": lasts_s, "cover.share_percent": 100.0}


def _other_markers(twin: Flight, clear: Scenario, map: Map, limits: Limits) -> _Made:
    """Yield probes with other markers around the marker, and with a second one of the same id.

    Detectors list markers in the order of their places in the picture.  The marker lies within a
    triangle of others, so that the first and the last of such a list is never the marker, whatever
    the order is, and another one is nearer to where the UAV starts or arrives.
    """
    side_m = clear.task.marker.side_m
    wanted_m = max(2.5 * side_m, 0.4 * _top_m(twin), 1.5 * limits.distance_m)
    away_m = round(min(wanted_m, DECOY_REACH_M), 1)
    placed = Placed(clear, map)
    (x, y), (east, north) = placed.marker_m, map.gps_position_m
    told_x, told_y = placed.told_m
    inward = math.atan2(told_y - y, told_x - x)
    places = [
        (x - east + away_m * math.cos(angle), y - north + away_m * math.sin(angle))
        for angle in (inward, inward + math.radians(120), inward - math.radians(120))
    ]
    values = {
        key: value
        for number, place in enumerate(places, start=1)
        for key, value in _decoy(number, "other-id", place).items()
    }
    sentence = f"three other markers of the dictionary lie around the marker, {away_m:g} m away"
    yield "other-markers", sentence, values, False
    sentence = f"a copy of the marker without its white margin lies {away_m:g} m beside it"
    # It lies farther from the mission's coordinate than the marker; to trust neither is right, too.
    yield "marker-twice", sentence, _decoy(1, "same-id-without-margin", places[1]), True


def _decoy(number: int, kind: str, place: tuple[float, float]) -> dict[str, float]:
    x, y = (max(-DECOY_REACH_M, min(DECOY_REACH_M, each)) for each in place)
    name = f"decoy-{number}"
    return {f"{name}.kind": float(DECOY_KINDS.index(kind)), f"{name}.x_m": x, f"{name}.y_m": y}


def _thick_air(twin: Flight, clear: Scenario, map: Map, camera: Camera) -> _Made:
    """Yield the probe in which the marker can be read from about half height on only, if any can.

    The oracle of detectability says from where.
    """
    top = _top_m(twin)
    views = []
    for fog, dust in AIRS:
        values = {"environment.fog": fog, "environment.dust": dust}
        views.append((_readable_from_m(clear.replace(values), map, camera, top), values))
    height, values = min(views, key=lambda each: abs(each[0] - top / 2))
    if NEAREST_VIEW * top <= height <= FARTHEST_VIEW * top:
        sentence = f"in fog and dust the marker can be read below {height:.0f} m only"
        yield "marker-low", sentence, values, True


def _readable_from_m(scenario: Scenario, map: Map, camera: Camera, top_m: float) -> float:
    """Return the greatest height above the marker from which it can be read; 0 from none."""
    placed = Placed(scenario, map)
    renderer = renderer_of(placed, true_camera(camera, scenario), LandingMoments(), colour=False)
    for step in range(HEIGHTS, 0, -1):
        height = top_m * step / HEIGHTS
        eye = eye_under(looks_at(camera, placed.marker_m, height), LEVEL, camera.offset_m)
        frame = renderer.render(eye, LEVEL, 0.0, [])
        if readable_probability(frame.marker) >= READABLE:
            return height
    return 0.0


def _starts(scenario: Scenario, map: Map, domain: Domain) -> Iterator[Probe]:
    """Yield probes that start, or arrive from the ground, over the marker and before it.

    The declared start stays; the marker lies elsewhere.
    """
    yield _start_probe("start-over", scenario, map, domain, ((0.0, 0.0),))
    away_m = _away_m(scenario, domain)
    sides = ((-away_m, 0.0), (away_m, 0.0))
    yield _start_probe("start-behind", scenario, map, domain, sides)


def _start_probe(
    name: str,
    scenario: Scenario,
    map: Map,
    domain: Domain,
    sides: Sequence[tuple[float, float]],
) -> Probe:
    """Return the probe whose marker lies at that side (x, y) of the start where most is free."""
    made = [(away, scenario.replace(_with_marker_at(scenario, map, away))) for away in sides]
    away, placed = max(made, key=lambda each: _free_places(each[1], map))
    where = "the start" if scenario.task.start.hovers else "the coordinate"
    far = f"{math.hypot(*away):g} m {compass_point(*away)} of" if any(away) else "below"
    return _probe(name, f"the marker lies {far} {where}", placed, map, domain)


def _free_places(scenario: Scenario, map: Map) -> int:
    """Return how free a place of the marker is: whether it is valid, and how many of its sides."""
    discs = [disc for body in map.bodies for disc in discs_of(body)]
    x, y = Placed(scenario, map).marker_m
    sides = (
        (x + dx * BESIDE_M, y + dy * BESIDE_M) for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))
    )
    free = sum(
        all(math.dist(side, (disc.x_m, disc.y_m)) > disc.radius_m for disc in discs)
        for side in sides
    )
    return free + (0 if problems(scenario, map) else 10)


def _with_marker_at(clear: Scenario, map: Map, away: tuple[float, float]) -> Mapping[str, float]:
    """Return the values with which the marker lies so far (x, y) from the start."""
    offset = clear.task.start.offset_m if clear.task.start.hovers else (0.0, 0.0)
    dx, dy = away[0] + offset[0], away[1] + offset[1]
    if clear["told.surveyed"] >= 0.5:
        towards = math.degrees(math.atan2(-dy, -dx)) % 360 if dx or dy else 0.0
        return {"told.error_m": math.hypot(dx, dy), "told.towards_deg": towards}
    told = Placed(clear, map).told_m
    return marker_genes((told[0] + dx, told[1] + dy), map)


def _wind(clear: Scenario, domain: Domain) -> _Made:
    """Yield the probe in a steady wind."""
    _, strongest = domain.range_of("wind.mean_mps") or (0.0, WIND_MPS)
    speed = min(WIND_MPS, strongest)
    if speed > clear["wind.mean_mps"]:
        values = {"wind.mean_mps": speed, "wind.towards_deg": 0.0}
        yield "level-wind", f"a steady wind of {speed:g} m/s blows to the east", values, False


def _top_m(twin: Flight) -> float:
    return feet_height_m(float(twin.uav.position_m[:, 2].max()))


def _half_way(twin: Flight) -> tuple[float, float] | None:
    """Return when a flight was half as far from the marker as when it could read it first.

    And how far that is, seen from above; None if it was never farther than ``FAR_M`` away.
    """
    readable = Evidence(twin).readable
    if not readable:
        return None
    places = twin.uav.position_m[:, :2] - np.array(twin.marker_position_m)
    away = np.hypot(places[:, 0], places[:, 1])
    since = int(np.searchsorted(twin.uav.time_s, readable[0].time_s))
    near = np.nonzero(away[since:] < away[since] / 2)[0]
    if away[since] < FAR_M or not len(near):
        return None
    index = since + int(near[0])
    return round(float(twin.uav.time_s[index]), 2), float(away[index])


def _half_height(twin: Flight) -> tuple[float, float]:
    """Return when a flight that landed came down through half of its height, and how high it was.

    The height is that of the feet, as in all texts.  A flight that held its place has no such
    moment: half of its time counts.
    """
    times_s, heights_m = twin.uav.time_s, twin.uav.position_m[:, 2]
    half = _top_m(twin) / 2
    passed = times_s < times_s[-1] / 2 if twin.outcome == "held" else heights_m > half
    last = np.nonzero(passed)[0][-1]
    return round(float(times_s[last]), 2), feet_height_m(float(heights_m[last]))
