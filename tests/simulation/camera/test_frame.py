"""A frame paints its image when it is asked for."""

from __future__ import annotations

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.validity import repair
from tests.support.pictures import LEVEL, poses, renderer


def test_an_image_asked_for_late_shows_its_own_moment() -> None:
    genes = {"rain": 0.3, "maple_leaf": 0.5, "road_leaf": 0.1, "fog": 0.05, "sun_position": 0.5}
    made, map = renderer("lawn", seed=4, genes=genes)
    x, y = made.marker_m
    tilted = (0.5, 0.0, 0.0, 0.866)
    late = made.render((x, y, 5.0), tilted, 1.0, poses(x, y))
    made.render((x + 2, y, 8.0), LEVEL, 2.0, poses(x + 1, y - 1))
    genome = genome_for(map, weather="full")
    clear = repair(decode(genome.nominal, genome, map="lawn", seed=4), map)
    made.change(clear.replace({"environment.road_snow": 0.9}))
    made.render((x + 2, y, 8.0), LEVEL, 3.0, poses(x - 1, y - 1))
    again, _ = renderer("lawn", seed=4, genes=genes)
    assert (late.image == again.render((x, y, 5.0), tilted, 1.0, poses(x, y)).image).all()
    assert (late.segmentation < 0).any(), "the horizon is part of this test"
