"""What a frame's MarkerView says, against the picture that it stands for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from pytest_garl.flight.flight import MarkerView
from pytest_garl.simulation.camera.frame import Frame
from tests.support.pictures import CAMERA, LEVEL, NONE, poses, renderer

FAR = [((50.0, 50.0, 0.0), 0.0)] * 3
MODULE_M = 1.5 / 7


def frame(
    height: float = 5.0,
    genes: Mapping[str, float] = NONE,
    place: tuple[float, float] = (0.0, 0.0),
    objects: Any = None,
    attitude: tuple[float, float, float, float] = LEVEL,
) -> Frame:
    made, _ = renderer("lawn", genes=genes)
    x, y = made.marker_m
    return made.render((x + place[0], y + place[1], height), attitude, 1.0, objects or FAR)


def view(*arguments: Any, **options: Any) -> MarkerView:
    seen = frame(*arguments, **options).marker
    assert seen is not None
    return seen


def on_marker(*offsets: tuple[float, float]) -> list[tuple[tuple[float, float, float], float]]:
    made, _ = renderer("lawn")
    x, y = made.marker_m
    placed = [((x + dx, y + dy, 0.0), 0.0) for dx, dy in offsets]
    return placed + FAR[len(placed) :]


def test_a_clear_view_from_above_is_whole_and_full_of_contrast() -> None:
    seen = view()
    assert seen.share_in_frame == 1.0
    assert seen.edge_modules == 1.0
    assert seen.px_per_module == pytest.approx(CAMERA.focal_px * MODULE_M / 5.0, rel=1e-3)
    assert seen.border_hidden + seen.bits_hidden + seen.margin_hidden < 0.02
    assert seen.contrast > 180
    assert (seen.blur_px, seen.clutter, seen.uneven_light) == (0.0, 0.0, 0.0)


def test_a_view_beside_the_marker_has_none() -> None:
    assert frame(place=(20.0, 0.0)).marker is None


def test_the_share_in_the_frame_is_that_of_the_picture() -> None:
    # The frame's lower edge is 0.75 of the height away; half of the marker is beyond it.
    half = view(4.0, place=(3.0, 0.0))
    assert half.share_in_frame == pytest.approx(0.5, abs=0.03)
    assert half.edge_modules < -3


def test_an_oblique_look_shrinks_the_shorter_axis() -> None:
    angle, height = 0.5, 5.0
    roll = (np.sin(angle / 2), 0.0, 0.0, np.cos(angle / 2))
    # Rolled to its right, the camera looks to its left, which is north: the marker is ahead.
    oblique = view(height, place=(0.0, -height * np.tan(angle)), attitude=roll)
    assert oblique.share_in_frame == 1.0
    straight = CAMERA.focal_px * MODULE_M / (height / np.cos(angle))
    assert oblique.px_per_module == pytest.approx(straight * np.cos(angle), rel=0.03)


@pytest.mark.parametrize(
    "genes",
    [
        {"fog": 0.3},
        {"dust": 0.5},
        {"sun_position": 0.02},
        {"road_wetness": 1.0, "sun_position": 0.2},
        {"fog": 0.1, "road_snow": 0.3, "sun_position": 0.9},
        {"rain": 0.8, "snow": 0.1},
    ],
)
def test_the_contrast_is_that_of_the_picture(genes: Mapping[str, float]) -> None:
    seen = frame(4.0, genes)
    grey = seen.image @ np.array([0.299, 0.587, 0.114])
    side = CAMERA.focal_px * MODULE_M / 4.0
    left, top = CAMERA.centre_px[0] - 3.5 * side, CAMERA.centre_px[1] - 3.5 * side
    # Middles of modules: those of the border are black, those of the margin white.
    middles = [
        ((left + (column + 0.5) * side), (top + (row + 0.5) * side), min(row, column) >= 0)
        for row in range(-1, 8)
        for column in range(-1, 8)
        if {row, column} & {-1, 0}
    ]
    found: dict[bool, list[int]] = {True: [], False: []}
    for u, v, black in middles:
        if min(u, v) > 0:
            found[black].append(grey[round(v), round(u)])
    contrast = np.median(found[False]) - np.median(found[True])
    assert seen.marker is not None
    assert seen.marker.contrast == pytest.approx(contrast, rel=0.15, abs=5)


def test_snow_hides_black_and_not_white() -> None:
    seen = view(genes={"road_snow": 1.0})
    assert seen.border_hidden > 0.95
    assert seen.margin_hidden < 0.05
    assert seen.contrast == 0.0


def test_leaves_hide_more_the_more_there_are() -> None:
    shares = [view(genes={"road_leaf": gene}).bits_hidden for gene in (0.0, 0.2, 0.5, 0.9)]
    assert shares == sorted(shares)
    assert shares[-1] > 10 * shares[0] + 0.1


def test_people_on_the_marker_hide_what_they_stand_on() -> None:
    free, crowded = view(), view(objects=on_marker((0.3, 0.2), (-0.3, -0.3)))
    assert crowded.bits_hidden > free.bits_hidden + 0.05


def test_a_shadow_over_the_marker_makes_its_light_uneven() -> None:
    beside = view(genes={"sun_position": 0.25}, objects=on_marker((-1.2, 0.0)))
    alone = view(genes={"sun_position": 0.25})
    assert alone.uneven_light == 0.0
    west = view(genes={"sun_position": 0.25}, objects=on_marker((1.2, 0.6)))
    assert max(beside.uneven_light, west.uneven_light) > 0.05


def test_night_costs_contrast_and_brings_noise() -> None:
    noon, night = view(), view(genes={"sun_position": 0.0})
    assert night.noise > 2 * noon.noise
    assert night.contrast < noon.contrast / 2


def test_falling_things_clutter_more_the_farther_the_camera() -> None:
    clutter = [view(height, {"maple_leaf": 1.0}).clutter for height in (1.5, 4.0, 9.0)]
    assert clutter == sorted(clutter)
    assert clutter[0] > 0.0


def test_the_expected_clutter_is_the_mean_of_the_pictures() -> None:
    made, _ = renderer("lawn", genes={"maple_leaf": 1.0})
    clear, _ = renderer("lawn")
    x, y = made.marker_m
    shares = []
    for second in range(40):
        bare, full = (each.render((x, y, 6.0), LEVEL, float(second), FAR) for each in (clear, made))
        difference = np.abs(bare.image.astype(int) - full.image.astype(int)).max(axis=2)
        shares.append((difference > 14).mean())
    seen = made.render((x, y, 6.0), LEVEL, 0.0, FAR).marker
    assert seen is not None
    assert seen.clutter == pytest.approx(np.mean(shares), rel=0.4)


def test_a_renderer_without_colour_tells_the_same() -> None:
    genes = {"road_leaf": 0.3, "fog": 0.05, "sun_position": 0.3}
    made = [renderer("lawn", genes=genes, colour=colour)[0] for colour in (True, False)]
    x, y = made[0].marker_m
    seen = [each.render((x, y, 4.0), LEVEL, 1.0, poses(x, y)).marker for each in made]
    assert seen[0] is not None
    assert seen[0] == seen[1]
