from __future__ import annotations

import itertools

import numpy as np
import pytest

from pytest_garl.adversary.scripted import policy_spec
from pytest_garl.errors import PolicyError
from pytest_garl.scenarios.genes import genome_for, with_destinations
from pytest_garl.scenarios.placement import object_destination_m
from pytest_garl.search.catalogue import make_method
from pytest_garl.search.methods.ga import polynomial_mutation
from pytest_garl.search.methods.random_search import propose
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.search.methods.test_nsga2 import MAP, bred, plan

NAMES = [name for name, _ in MAP.object_names]


def test_every_object_of_every_scenario_has_a_destination() -> None:
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


def test_mutation_moves_as_many_properties_as_the_papers_and_mostly_a_little() -> None:
    rows = np.full((2000, 3), [0.5, 0.0, 0.15])
    lower, upper = np.array([0.0, -1.0, 0.0]), np.array([1.0, 1.0, 0.15])
    moved = polynomial_mutation(rows, lower, upper, np.random.default_rng(1))
    assert (moved[:, :2] != rows[:, :2]).mean() == pytest.approx(0.2, abs=0.02)
    assert (moved >= lower).all()
    assert (moved <= upper).all()
    steps = np.abs(moved - rows)[:, :2] / (upper - lower)[:2]
    assert (steps[steps > 0] < 0.1).mean() > 0.8
    assert (moved[:, 2] < 0.15).any()


@pytest.mark.sim
def test_objects_walk_to_their_destination_and_back() -> None:
    scenario = propose(MAP, with_destinations(genome_for(MAP)), 2, 0, 1)[0]
    scenario = scenario.replace({f"{name}.velocity": 1.0 for name in NAMES})
    # Clear of bodies, and of each other.
    places = ((-0.8, 0.8), (0.8, 0.8), (-0.8, -0.8), (0.8, -0.8))
    ends = {
        f"{n}.destination_{axis}": at[i]
        for n, at in zip(NAMES, places, strict=True)
        for i, axis in enumerate("xy")
    }
    flight = fly(scenario.replace(ends), ReferencePilot, policy_spec("destination"), map=MAP)
    for item in flight.objects:
        goal = object_destination_m(scenario.replace(ends), MAP, item.name)
        assert goal is not None
        way = item.track.position_m[:, :2]
        from_goal = np.linalg.norm(way - np.array(goal), axis=1)
        there = int(from_goal.argmin())
        assert from_goal[there] < 1.5, item.name
        from_start = np.linalg.norm(way[there:] - way[0], axis=1)
        assert from_start.min() < 0.5 * from_start[0], item.name


def test_objects_without_a_destination_are_told() -> None:
    scenario = propose(MAP, genome_for(MAP), 2, 0, 1)[0]
    with pytest.raises(PolicyError, match=r"no gene 'person-1.destination_x'.*--garl-method"):
        fly(scenario, ReferencePilot, policy_spec("destination"), map=MAP, time_limit_s=1)


def test_an_object_keeps_its_destination_with_its_start() -> None:
    genome = with_destinations(genome_for(MAP))
    for gene in genome.genes:
        if gene.name in NAMES:
            assert len(gene.properties) == 5
    borders = {*genome.borders}
    for before, after in itertools.pairwise(range(genome.size)):
        same = genome.keys[before].partition(".")[0] == genome.keys[after].partition(".")[0]
        if same and genome.keys[before].partition(".")[0] in NAMES:
            assert after not in borders
