"""A chromosome and its scenario say the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map

COURT = load_map("court")


unit = st.floats(0, 1)


@given(shares=st.lists(unit, min_size=23, max_size=23), seed=st.integers(0, 2**63))
def test_decode_and_encode_are_exact_inverses(shares: list[float], seed: int) -> None:
    genome = genome_for(COURT)
    vector = genome.lower + np.array(shares) * (genome.upper - genome.lower)
    vector = np.clip(vector, genome.lower, genome.upper)
    scenario = decode(vector, genome, map="court", seed=seed)
    assert (encode(scenario, genome) == vector).all()
    assert decode(encode(scenario, genome), genome, map="court", seed=seed) == scenario


def test_a_chromosome_out_of_range_names_the_gene() -> None:
    genome = genome_for(COURT)
    vector = genome.nominal
    vector[genome.keys.index("environment.fog")] = 0.2
    with pytest.raises(ScenarioError, match=r"environment\.fog.*found 0.2"):
        decode(vector, genome, map="court", seed=0)
