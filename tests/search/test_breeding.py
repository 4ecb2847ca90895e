from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.breeding import WAYS, Breeding
from pytest_garl.search.columns import Columns
from pytest_garl.search.exploration import Exploration
from pytest_garl.search.operators import Matrix

MAP = load_map("court")
COLUMNS = Columns(genome_of(domain_named("field"), MAP))
BREEDING = Breeding(COLUMNS, Exploration(COLUMNS, MAP))


def row_with(*names: str, seed: int = 0) -> Matrix:
    row = COLUMNS.genome.random_active(np.random.default_rng(seed), names)
    return COLUMNS.with_active(row, names)


@pytest.mark.parametrize("way", WAYS)
def test_a_child_is_another_sparse_chromosome_in_the_domain(way: str) -> None:
    parent, donor = row_with("wind", "fog", "dog-1"), row_with("rain", "pad", seed=1)
    rng = np.random.default_rng(2)
    for _ in range(50):
        child = BREEDING.child(way, parent, donor, "dog-1", rng)
        assert not np.array_equal(child, parent)
        assert ((child >= COLUMNS.lower) & (child <= COLUMNS.upper)).all()
        assert len(COLUMNS.active(child)) == 3
        rest = ~(COLUMNS.counting(child) | COLUMNS.counting(parent))
        bits = np.array([key.startswith("active.") for key in COLUMNS.genome.keys])
        np.testing.assert_array_equal(child[rest & ~bits], parent[rest & ~bits])


def test_harder_children_lie_farther_from_nominal_and_milder_ones_nearer() -> None:
    parent, rng = row_with("wind", "fog", "snow"), np.random.default_rng(3)
    far = COLUMNS.distance_from_nominal(parent)
    for way, sign in (("harden", 1), ("soften", -1)):
        children = [BREEDING.child(way, parent, parent, "", rng) for _ in range(20)]
        changes = [sign * (COLUMNS.distance_from_nominal(each) - far) for each in children]
        assert min(changes) >= -1e-9
        assert max(changes) > 0.05


def test_a_graft_keeps_the_npc_that_the_flight_came_nearest_to() -> None:
    parent, donor = row_with("wind", "fog", "dog-1"), row_with("rain", "pad", seed=1)
    rng = np.random.default_rng(4)
    for _ in range(30):
        names = {
            gene.name
            for gene in COLUMNS.active(BREEDING.child("graft", parent, donor, "dog-1", rng))
        }
        assert "dog-1" in names
        assert len(names & {"rain", "pad"}) == 1


def test_a_genome_without_optional_genes_is_bred_by_steps() -> None:
    columns = Columns(genome_for(MAP))
    breeding = Breeding(columns, Exploration(columns, MAP))
    rng = np.random.default_rng(6)
    parent, donor = columns.genome.random(rng), columns.genome.random(rng)
    for way in WAYS:
        child = breeding.child(way, parent, donor, "", rng)
        assert not np.array_equal(child, parent)
