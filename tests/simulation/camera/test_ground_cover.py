"""Leaves and snow lie where they are painted."""

from __future__ import annotations

import numpy as np

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
