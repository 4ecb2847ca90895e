from __future__ import annotations

import itertools

import numpy as np
import pytest

from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.methods.ga import polynomial_mutation
from tests.search.searches import MAP, bred, plan

NAMES = [name for name, _ in MAP.present_objects]


def test_every_npc_of_every_scenario_has_a_destination() -> None:
    wanted = with_destinations(genome_for(MAP)).keys
    for generation in bred(make_method("ga", plan()), 4):
        for scenario in generation:
            assert tuple(key for key, _ in scenario.genes) == wanted


def test_destinations_are_bred() -> None:
    first, *_, last = bred(make_method("ga", plan(population=20)), 8)

    early, late = (
        {each[f"{name}.destination_x"] for each in generation for name in NAMES}
        for generation in (first, last)
    )
    assert early & late
    assert late - early


def test_mutation_moves_a_fifth_of_the_properties_mostly_a_little() -> None:
    rows = np.full((2000, 3), [0.5, 0.0, 0.15])
    lower, upper = np.array([0.0, -1.0, 0.0]), np.array([1.0, 1.0, 0.15])
    moved = polynomial_mutation(rows, lower, upper, np.random.default_rng(1))
    assert (moved[:, :2] != rows[:, :2]).mean() == pytest.approx(0.2, abs=0.02)
    assert (moved >= lower).all()
    assert (moved <= upper).all()
    steps = np.abs(moved - rows)[:, :2] / (upper - lower)[:2]
    assert (steps[steps > 0] < 0.1).mean() > 0.8
    assert (moved[:, 2] < 0.15).any()


def test_an_npc_keeps_its_destination_with_its_start() -> None:
    genome = with_destinations(genome_for(MAP))
    for gene in genome.genes:
        if gene.name in NAMES:
            assert len(gene.properties) == 5
    borders = {*genome.borders}
    for before, after in itertools.pairwise(range(genome.size)):
        same = genome.keys[before].partition(".")[0] == genome.keys[after].partition(".")[0]
        if same and genome.keys[before].partition(".")[0] in NAMES:
            assert after not in borders
