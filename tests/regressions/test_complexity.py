from __future__ import annotations

from pytest_garl.regressions.complexity import complexity, genome_of
from tests.regressions.samples import COLLIDING_OBJECT, LAWN, OBJECT_NAMES, VIOLATING_SCENARIO

GENOME = genome_of(VIOLATING_SCENARIO, LAWN)


def test_complexity_counts_objects_genes_distance_and_digits() -> None:
    objects, genes, distance, digits = complexity(VIOLATING_SCENARIO, GENOME)
    assert objects == len(OBJECT_NAMES)
    fewer = VIOLATING_SCENARIO.without(*OBJECT_NAMES[1:]).replace({"environment.fog": 0.0})
    less = complexity(fewer, GENOME)
    assert less[0] == 1
    assert less[1] < genes
    assert less[2] < distance
    assert less[3] < digits


def test_place_of_an_object_counts_by_its_digits_alone() -> None:
    moved = VIOLATING_SCENARIO.replace({f"{COLLIDING_OBJECT}.start_x": 0.9})
    assert complexity(moved, GENOME)[:3] == complexity(VIOLATING_SCENARIO, GENOME)[:3]
    assert complexity(moved, GENOME) < complexity(VIOLATING_SCENARIO, GENOME)
