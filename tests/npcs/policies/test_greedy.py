from __future__ import annotations

import itertools
import math

import pytest

from tests.support.situations import walk


def test_greedy_crosses_the_marker_again_and_again() -> None:
    path = walk("greedy", (-4.0, 1.0), 40)
    sides = [math.copysign(1, x - 3) for x, _ in path if abs(x - 3) > 0.4]
    assert sum(a != b for a, b in itertools.pairwise(sides)) >= 5
    steps = [math.dist(a, b) for a, b in itertools.pairwise(path)]
    assert min(steps) == pytest.approx(1.0)
