from __future__ import annotations

import math

from tests.support.situations import walk


def test_stand_walks_to_the_marker_and_stays() -> None:
    path = walk("stand", (-4.3, 2.0), 12)
    assert math.dist(path[-1], (3, 1)) < 1e-6
