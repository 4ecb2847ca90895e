from __future__ import annotations

import itertools
import math

import pytest

from tests.support.situations import MAP, walk


def test_an_npc_walks_straight_to_one_place_after_the_other_within_the_map() -> None:
    path = walk("waypoint", (0.0, 0.0), 200)
    x_min, x_max, y_min, y_max = MAP.bounds_m
    assert all(x_min <= x <= x_max and y_min <= y <= y_max for x, y in path)
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(path)]
    assert all(math.hypot(*step) == pytest.approx(1.0) for step in steps)
    turns = sum(math.dist(a, b) > 1e-6 for a, b in itertools.pairwise(steps))
    assert 3 <= turns < len(steps) / 2
