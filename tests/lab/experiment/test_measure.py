from __future__ import annotations

import numpy as np
import pytest

from lab.experiment.measure import chromosomes
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.methods.random import random_scenarios

MAP = load_map("lawn")


@pytest.mark.parametrize("domain", ["paper", "field"])
def test_distances_leave_out_the_destinations_of_npcs(domain: str) -> None:
    genome = genome_for(MAP, weather="confined" if domain == "paper" else "full")
    bound = random_scenarios(MAP, with_destinations(genome), 3, 0, 5)
    raw, genes = chromosomes(bound, MAP, domain)
    assert raw.shape == (5, 8)
    assert genes.shape == (5, genome.size)
    assert genes.min() >= 0
    assert genes.max() <= 1
    for scenario, weather_of, row in zip(bound, raw, genes, strict=True):
        assert weather_of[0] == scenario["environment.dust"]
        known = np.array([scenario[key] for key in genome.keys])
        assert np.allclose(genome.normalise(known), row)
