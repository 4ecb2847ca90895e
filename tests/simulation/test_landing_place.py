"""What lies under a UAV that touches down: marker, decoy, shadow, line, or nothing."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np
import pytest

from pytest_garl.fiducial import PAPER_MARKER
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Layer, Map
from pytest_garl.scenarios.placed import Pad, PlacedMarker
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera import map_texture
from pytest_garl.simulation.camera.canvas import Canvas
from pytest_garl.simulation.landing_place import REACH_M, what_lies_under

COURT, LAWN = load_map("court"), load_map("lawn")
FAR_M = (30.0, 30.0)
NOON, DUSK = 0.5, 1.0


def scenario_at(map: Map, sun: float) -> Scenario:
    genome = genome_for(map)
    scenario = decode(genome.nominal, genome, map=map.name, seed=5)
    return scenario.replace({"environment.sun_position": sun})


def marker_at(place_m: tuple[float, float], yaw_rad: float = 0.0) -> PlacedMarker:
    return Pad(spec=PAPER_MARKER, place_m=place_m, yaw_rad=yaw_rad).main


def under(
    place: tuple[float, float],
    map: Map = COURT,
    marker_m: tuple[float, float] = FAR_M,
    sun: float = NOON,
) -> str:
    scenario = scenario_at(map, sun)
    return what_lies_under(place, marker_at(marker_m), map.ground.layers, map.bodies, scenario)


@pytest.mark.parametrize("map", [COURT, LAWN], ids=lambda map: map.name)
def test_marker_lies_under_a_uav_whose_hull_reaches_it(map: Map) -> None:
    at = (1.0, 1.0)
    for dx, found in ((0.0, True), (0.74, True), (1.24, True), (1.26, False)):
        assert (under((1.0 + dx, 1.0), map, at) == "marker") == found
    corner = 0.75 + REACH_M / math.sqrt(2)
    assert under((1.0 + corner - 0.01, 1.0 + corner - 0.01), map, at) == "marker"
    assert under((1.0 + corner + 0.01, 1.0 + corner + 0.01), map, at) != "marker"


def test_decoy_is_named_and_turned_as_it_lies() -> None:
    turn = math.radians(20)
    decoy = (-5.6, 4.4)
    assert under(decoy) == "decoy-marker-3"
    for across, found in ((1.2, True), (1.3, False)):
        place = (decoy[0] + across * math.cos(turn), decoy[1] + across * math.sin(turn))
        assert (under(place) == "decoy-marker-3") == found


def test_nearer_of_marker_and_decoy_counts() -> None:
    decoy = (-5.6, 4.4)
    assert under((decoy[0] + 0.2, decoy[1]), marker_m=(decoy[0] + 2.0, decoy[1])) == (
        "decoy-marker-3"
    )
    assert under((decoy[0] + 1.4, decoy[1]), marker_m=(decoy[0] + 2.0, decoy[1])) == "marker"


@pytest.mark.parametrize(
    ("place", "found"),
    [
        ((6.0, 14.4), "line"),  # beside the end line
        ((6.0, 13.0), "nothing"),
        ((0.0, 10.0), "line"),  # a restricted area
        ((0.0, 0.5), "line"),  # the centre circle, which is filled
        ((0.0, -4.6), "nothing"),  # outside the arc's half of its circle
        ((0.0, 6.0), "line"),  # the arc of the free-throw circle
        ((0.0, 5.3), "line"),  # the three-point arc
        ((3.0, 4.0), "nothing"),
    ],
)
def test_lines_and_areas_of_the_court_are_found(place: tuple[float, float], found: str) -> None:
    assert under(place, sun=DUSK) == found


def test_worn_patches_are_nothing() -> None:
    assert under((3.0, -4.0), LAWN, sun=DUSK) == "nothing"
    assert under((3.0, -4.0), LAWN, sun=NOON) == "nothing"


def test_shadow_of_a_tree_lies_where_the_camera_paints_it() -> None:
    # At noon the sun stands in the south at 60 degrees: shadows fall to the north.
    tree = next(body for body in LAWN.bodies if body.name == "tree-1")
    height_m = 5.5
    place = (tree.position_m[0], tree.position_m[1] + 0.7 * height_m / math.tan(math.pi / 3))
    assert under(place, LAWN, sun=NOON) == "shadow"
    assert under(place, LAWN, sun=DUSK) == "nothing"
    south = (tree.position_m[0], tree.position_m[1] - 4.0)
    assert under(south, LAWN, sun=NOON) == "nothing"


def test_target_counts_before_what_is_painted_there() -> None:
    assert under((0.0, 10.0), marker_m=(0.0, 11.0)) == "marker"


LAYERS = [
    Layer(kind="rectangle", points_m=((-1.0, -0.5), (1.0, 0.5))),
    Layer(kind="line", points_m=((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)), size_m=0.2),
    Layer(kind="circle", points_m=((0.2, 0.1),), size_m=1.0),
    Layer(kind="circle", points_m=((0.2, 0.1),), size_m=1.0, width_m=0.2),
    Layer(kind="arc", points_m=((0.2, 0.1),), size_m=1.0, width_m=0.2, angles_rad=(0.5, 4.0)),
    Layer(kind="arc", points_m=((0.2, 0.1),), size_m=1.0, angles_rad=(0.0, math.pi)),
    Layer(kind="polygon", points_m=((0.0, 0.0), (1.5, 0.2), (0.3, 1.0))),
]


@pytest.mark.parametrize("layer", LAYERS, ids=lambda layer: f"{layer.kind}-{layer.width_m}")
def test_what_is_found_is_what_the_camera_paints(layer: Layer) -> None:
    """Compare the distance of many places with the nearest painted pixel."""
    bounds, m_per_px = (-4.0, 4.0, -4.0, 4.0), 0.02
    canvas = Canvas(np.zeros((400, 400, 3), np.uint8), bounds, m_per_px)
    map_texture._paint_layer(canvas, layer, np.random.default_rng(0))
    unpainted = (canvas.image.max(axis=2) < 128).astype(np.uint8)
    distances_m = cv2.distanceTransform(unpainted, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * m_per_px
    rng = np.random.default_rng(1)
    scenario = scenario_at(LAWN, DUSK)
    decided = 0
    for x, y in rng.uniform(-2.5, 2.5, (400, 2)):
        distance_m = float(
            distances_m[round((4.0 - y) / m_per_px - 0.5), round((x + 4.0) / m_per_px - 0.5)]
        )
        if abs(distance_m - REACH_M) < 2 * m_per_px:
            continue
        decided += 1
        found = what_lies_under((x, y), marker_at(FAR_M), [layer], [], scenario)
        assert (found == "line") == (distance_m < REACH_M), (x, y, distance_m)
    assert decided > 300


def test_moving_bodies_cast_shadows_too() -> None:
    tree = dataclasses.replace(LAWN.bodies[0], position_m=(0.0, 0.0, 0.0))
    scenario = scenario_at(LAWN, NOON)
    assert what_lies_under((0.0, 2.0), marker_at(FAR_M), (), [tree], scenario) == "shadow"
    assert what_lies_under((0.0, 2.0), marker_at(FAR_M), (), [], scenario) == "nothing"
