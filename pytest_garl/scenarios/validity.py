"""Whether a scenario makes sense, and the nearest one that does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from pytest_garl.errors import ScenarioError
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.scenarios.bodies import Disc, discs_of
from pytest_garl.scenarios.groups import CLEARANCE, DECOY_REACH_M, GROUPS
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import (
    MARKER_RADIUS_M,
    UAV_CLEARANCE_M,
    Place,
    Placed,
    marker_genes,
    start_genes,
)
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import PLACE_DIGITS, snapped

UAV_REACH_M = 0.75
MARGIN_M = 0.25
"""No static part stands or hangs nearer to the marker's corners than the margin, nor to its centre
than reach and margin of a UAV of 1 m, so that such a UAV can reach it; `pad.clearance_m` asks for
less."""
MARGINED = 1 + 2 / 6
"""Widest print of a marker as a share of its side: one of four bits with its white margin."""
OBJECT_CLEARANCE_M = 0.3
_RING_STEP_M = 0.1
_DIRECTIONS = 32


def problems(scenario: Scenario, map: Map) -> tuple[str, ...]:
    """Return what is wrong with the scenario, one sentence each; nothing if it is valid."""
    placed = Placed(scenario, map)
    discs = _discs_on(map)
    found = [*_marker_problems(placed, discs, placed.marker_m), *_decoy_problems(placed)]
    for index, (name, _) in enumerate(placed.map.present_objects):
        found += _start_problems(placed, discs, index, placed.npc(name).start_m)
    return tuple(found)


def repair(scenario: Scenario, map: Map) -> Scenario:
    """Return the scenario with each offending place moved to the nearest valid one.

    Its values are those that a file can write.  A valid scenario of such values comes back
    unchanged.  The marker is repaired first, then the objects in order, each against what is
    settled already.  Raises ScenarioError if the map leaves no room.
    """
    scenario = snapped(scenario, map)
    discs = _discs_on(map)
    wanted = Placed(scenario, map)
    if any(_marker_problems(wanted, discs, wanted.marker_m)):
        place = _nearest(
            wanted.marker_m,
            lambda at: not any(_marker_problems(wanted, discs, at)),
            lambda at: Placed(wanted.scenario.replace(marker_genes(at, map)), map).marker_m,
        )
        scenario = scenario.replace(marker_genes(place, map))
    placed = Placed(_with_free_decoys(scenario, map), map)
    for index, (name, _) in enumerate(placed.map.present_objects):

        def free(at: Place, placed: Placed = placed, index: int = index) -> bool:
            return not any(_start_problems(placed, discs, index, at))

        def moved(at: Place, placed: Placed = placed, name: str = name) -> Placed:
            return Placed(placed.scenario.replace(start_genes(name, at, map)), map)

        def kept(at: Place, moved: Callable[[Place], Placed] = moved, name: str = name) -> Place:
            return moved(at).npc(name).start_m

        start = placed.npc(name).start_m
        if not free(start):
            placed = moved(_nearest(start, free, kept))
    return placed.scenario


def _discs_on(map: Map) -> tuple[Disc, ...]:
    return tuple(disc for body in map.bodies for disc in discs_of(body))


def _nearest(
    origin: Place,
    valid: Callable[[Place], bool],
    kept: Callable[[Place], Place] = lambda at: at,
    within_m: float = 200.0,
) -> Place:
    """Search rings of growing radius for a place that is valid as a scenario keeps it.

    ``kept`` returns a place as genes give it back, which may be nearer by a rounding error.
    """
    ring = 0
    while True:
        ring += 1
        for step in range(_DIRECTIONS):
            angle = 2 * math.pi * step / _DIRECTIONS
            radius = ring * _RING_STEP_M
            x, y = origin[0] + radius * math.cos(angle), origin[1] + radius * math.sin(angle)
            at = round(x, PLACE_DIGITS), round(y, PLACE_DIGITS)
            if valid(at) and valid(kept(at)):
                return at
        if ring * _RING_STEP_M > within_m:
            raise ScenarioError(f"no valid place within {within_m:g} m; the map leaves no room")


def clearance_m(marker: MarkerSpec, wanted_m: float = CLEARANCE.nominal) -> float:
    """Return how far a marker's centre is from every static part, at least.

    A scenario may want less than what reach and margin ask for.
    """
    usual = max(marker.half_diagonal_m, UAV_REACH_M) + MARGIN_M
    return min(usual, wanted_m) if wanted_m < CLEARANCE.nominal else usual


def _marker_problems(placed: Placed, discs: Iterable[Disc], marker: Place) -> Iterable[str]:
    """Yield what is wrong with a place of the marker."""
    scenario, map = placed.scenario, placed.map
    (x, y), spec = marker, scenario.task.marker
    clearance = clearance_m(spec, scenario["pad.clearance_m"])
    if math.dist(marker, map.gps_position_m) > MARKER_RADIUS_M + 1e-9:
        yield "the marker lies outside its disc of 7.5 m"
    for disc in discs:
        if math.hypot(x - disc.x_m, y - disc.y_m) < disc.radius_m + clearance:
            yield f"the marker is under or too near {disc.name}"
            break
    for layer in map.ground.layers:
        if layer.kind == "marker":
            reach = spec.half_diagonal_m + layer.size_m / math.sqrt(2)
            if math.dist(marker, layer.points_m[0]) < reach:
                yield f"the marker overlaps {layer.name}"
    if math.dist(marker, map.uav_start_m[:2]) < UAV_CLEARANCE_M:
        yield "the marker lies under the UAV's start"


def _decoy_problems(placed: Placed, among: str = "") -> Iterable[str]:
    """Yield what is wrong with the decoys, or with the one of a name; a later one gives way."""
    taken = [("the marker", placed.marker_m, placed.scenario.task.marker.reach_m)]
    taken += [
        (each.name, each.points_m[0], each.size_m * MARGINED / math.sqrt(2))
        for each in placed.map.ground.layers
        if each.kind == "marker"
    ]
    for decoy in placed.decoys:
        reach = decoy.side_m * MARGINED / math.sqrt(2)
        if among in ("", decoy.name):
            for name, place, other_reach in taken:
                if math.dist(decoy.place_m, place) < reach + other_reach:
                    yield f"{decoy.name} overlaps {name}"
        taken.append((decoy.name, decoy.place_m, reach))


def _with_free_decoys(scenario: Scenario, map: Map) -> Scenario:
    """Return the scenario with each decoy moved to where it is free, or without it if none is."""
    for decoy in Placed(scenario, map).decoys:
        x, y = f"{decoy.name}.x_m", f"{decoy.name}.y_m"

        def moved(at: Place, scenario: Scenario = scenario, x: str = x, y: str = y) -> Scenario:
            return scenario.replace({x: at[0], y: at[1]})

        def free(at: Place, name: str = decoy.name) -> bool:
            near = max(abs(at[0]), abs(at[1])) <= DECOY_REACH_M
            return near and not any(_decoy_problems(Placed(moved(at), map), name))

        place = scenario[x], scenario[y]
        if not free(place):
            try:
                scenario = moved(_nearest(place, free, within_m=2 * math.sqrt(2) * DECOY_REACH_M))
            except ScenarioError:
                # A marker of several metres and its like can fill the square.
                scenario = scenario.replace(GROUPS[decoy.name].nominal)
    return scenario


def _start_problems(placed: Placed, discs: Iterable[Disc], index: int, at: Place) -> Iterable[str]:
    """Yield what is wrong with a start of an NPC."""
    map, marker = placed.map, placed.scenario.task.marker
    name, kind_name = map.present_objects[index]
    kind = OBJECT_TYPES[kind_name]
    reach = kind.radius_m + OBJECT_CLEARANCE_M
    bottom_m = placed.npc(name).height_m + kind.low_m
    x_min, x_max, y_min, y_max = map.bounds_m
    tolerance = 1e-9
    if not (
        x_min - tolerance <= at[0] <= x_max + tolerance
        and y_min - tolerance <= at[1] <= y_max + tolerance
    ):
        yield f"{name} starts outside the map"
    for disc in discs:
        overlaps = disc.low_m < bottom_m + kind.height_m and bottom_m < disc.high_m
        if overlaps and math.hypot(at[0] - disc.x_m, at[1] - disc.y_m) < disc.radius_m + reach:
            yield f"{name} starts in or at {disc.name}"
            break
    # A hovering UAV is away from what walks below it.
    x, y, height = placed.start_m
    if math.dist(at, (x, y)) < UAV_CLEARANCE_M and kind.top_m + UAV_CLEARANCE_M > height:
        yield f"{name} starts at the UAV"
    if math.dist(at, placed.marker_m) < marker.half_diagonal_m + kind.radius_m:
        yield f"{name} starts on or over the marker"
    for other, other_kind in map.present_objects[:index]:
        near = kind.radius_m + OBJECT_TYPES[other_kind].radius_m
        if math.dist(at, placed.npc(other).start_m) < near:
            yield f"{name} starts inside {other}"
