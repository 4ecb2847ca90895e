"""Leaves and snow lie where they are painted."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.simulation.camera.ground_cover import covered
from tests.support.pictures import LEVEL, renderer


def test_places_under_leaves_are_those_that_are_painted_so() -> None:
    made, _ = renderer(genes={"road_leaf": 0.4})
    bare, _ = renderer()
    x, y = made.marker_m
    far_away = [((50.0, 50.0, 0.0), 0.0)] * 3
    frames = [each.render((x, y, 2.0), LEVEL, 0.0, far_away).image for each in (made, bare)]
    changed = np.abs(frames[0].astype(int) - frames[1].astype(int)).max(axis=2) > 30
    rows, columns = np.mgrid[20:220:3, 20:300:3].reshape(2, -1)
    # At zero yaw up is east and right is south; 2 m up a pixel is 2 m / 160.
    places = np.column_stack([x + (119.5 - rows) / 80, y - (columns - 159.5) / 80])
    agreed = made.covered(places) == changed[rows, columns]
    assert agreed.mean() > 0.9  # but for the leaves' edges
    assert 0.3 < made.covered(places).mean() < 0.5
    assert not bare.covered(places).any()


def patches(cover: float) -> NDArray[np.bool_]:
    conditions = dataclasses.replace(renderer()[0].conditions, snow_cover=cover)
    steps = (np.arange(400) + 0.5) * 0.04
    places = np.stack(np.meshgrid(steps, steps), axis=2).reshape(-1, 2)
    return covered(places, np.zeros(2), conditions).reshape(400, 400)


def test_snow_covers_the_share_that_is_asked_for_and_grows_from_the_same_places() -> None:
    little, much = patches(0.05), patches(0.15)
    assert little.mean() == pytest.approx(0.05, abs=0.003)
    assert much.mean() == pytest.approx(0.15, abs=0.003)
    assert not (little & ~much).any()
    assert patches(1.0).all()


def test_snow_lies_in_patches_larger_than_a_module_of_the_marker() -> None:
    count, _, statistics, _ = cv2.connectedComponentsWithStats(patches(0.15).astype(np.uint8))
    areas_m2 = np.sort(statistics[1:, cv2.CC_STAT_AREA] * 0.04**2)[::-1]
    # Of what 15 % cover, nine tenths lie in patches of a square metre or more.
    assert areas_m2[areas_m2 > 1].sum() > 0.9 * areas_m2.sum()
    assert count > 3


def test_snow_is_thin_at_its_edge() -> None:
    made, _ = renderer(genes={"road_snow": 0.3})
    bare, _ = renderer()
    x, y = made.marker_m
    far_away = [((50.0, 50.0, 0.0), 0.0)] * 3
    seen, ground = (
        each.render((x, y, 8.0), LEVEL, 0.0, far_away).image.astype(float) for each in (made, bare)
    )
    shares = (seen - ground).mean(axis=2) / np.maximum(240 - ground.mean(axis=2), 1)
    assert ((shares > 0.25) & (shares < 0.75)).mean() > 0.02


def test_nothing_shines_through_deep_snow() -> None:
    made, _ = renderer(genes={"road_snow": 0.9})
    bare, _ = renderer()
    x, y = made.marker_m
    far_away = [((50.0, 50.0, 0.0), 0.0)] * 3
    seen, ground = (
        each.render((x, y, 8.0), LEVEL, 0.0, far_away).image.astype(float) for each in (made, bare)
    )
    shares = (seen - ground).mean(axis=2) / np.maximum(240 - ground.mean(axis=2), 1)
    # An even light would leave 2 % of the ground's contrast in half of the picture.
    assert np.median(shares) > 0.99
