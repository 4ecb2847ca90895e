from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.search.columns import STRATA, Columns
from pytest_garl.search.exploration import Exploration

COLUMNS = Columns(genome_of(domain_named("field"), load_map("court")))


@pytest.mark.parametrize("stratum", STRATA)
def test_a_scenario_belongs_to_its_stratum_and_is_sparse(stratum: str) -> None:
    exploration, rng = Exploration(COLUMNS), np.random.default_rng(0)
    for _ in range(50):
        row = exploration.new(stratum, rng)
        assert COLUMNS.stratum(row) == stratum
        assert len(COLUMNS.active(row)) == 3
        assert ((row >= COLUMNS.lower) & (row <= COLUMNS.upper)).all()


def test_conditions_are_harsher_than_the_domain_draws_them() -> None:
    exploration, rng = Exploration(COLUMNS), np.random.default_rng(0)
    for gene in COLUMNS.optional:
        if gene.is_npc or not COLUMNS.outward[gene.values].any():
            continue
        harsh = [COLUMNS.harshness(exploration.values(gene, rng), gene) for _ in range(200)]
        plain = [
            COLUMNS.harshness(COLUMNS.genome.random_active(rng, (gene.name,)), gene)
            for _ in range(200)
        ]
        assert np.mean(harsh) > np.mean(plain), gene.name
