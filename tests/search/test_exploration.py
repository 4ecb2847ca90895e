from __future__ import annotations

import itertools

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
        exploration.note(row)
        assert COLUMNS.stratum(row) == stratum
        assert len(COLUMNS.active(row)) == 3
        assert ((row >= COLUMNS.lower) & (row <= COLUMNS.upper)).all()


def test_pairs_of_genes_are_covered_sooner_than_by_chance() -> None:
    def pairs(covers: bool) -> int:
        exploration, rng = Exploration(COLUMNS, covers=covers), np.random.default_rng(3)
        seen: set[tuple[str, ...]] = set()
        for _ in range(60):
            row = exploration.new("nobody", rng)
            exploration.note(row)
            names = sorted(gene.name for gene in COLUMNS.active(row))
            seen.update(itertools.combinations(names, 2))
        return len(seen)

    assert pairs(True) > 1.1 * pairs(False)


def test_values_lie_away_from_earlier_ones() -> None:
    wind = next(gene for gene in COLUMNS.optional if gene.name == "wind")
    low, high = COLUMNS.lower[wind.values], COLUMNS.upper[wind.values]

    def least_gap(exploration: Exploration, *, remembers: bool) -> float:
        rng, shares = np.random.default_rng(4), []
        for _ in range(40):
            row = COLUMNS.with_active(exploration.values(wind, rng), ("wind",))
            if remembers:
                exploration.note(row)
            shares.append((row[wind.values] - low) / (high - low))
        apart = np.linalg.norm(np.array(shares)[:, None] - np.array(shares)[None, :], axis=2)
        np.fill_diagonal(apart, np.inf)
        return float(apart.min(axis=1).mean())

    spread, plain = Exploration(COLUMNS), Exploration(COLUMNS)
    assert least_gap(spread, remembers=True) > 1.2 * least_gap(plain, remembers=False)
