from __future__ import annotations

import itertools

from tests.support.situations import walk


def test_each_step_is_one_of_the_papers_five_actions() -> None:
    path = walk("random_walk", (0.0, 0.0), 60)
    steps = {(round(b[0] - a[0], 6), round(b[1] - a[1], 6)) for a, b in itertools.pairwise(path)}
    assert steps == {(0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0)}


def test_the_way_depends_on_the_generator_alone() -> None:
    assert walk("random_walk", (0.0, 0.0), 20) == walk("random_walk", (0.0, 0.0), 20)
