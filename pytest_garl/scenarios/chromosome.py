"""Scenario to chromosome and back: exact inverses, since both hold gene units."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.scenario import Scenario


def encode(scenario: Scenario, genome: Genome) -> NDArray[np.float64]:
    """Return the scenario's values in the genome's order, shape (size,)."""
    found = {key for key, _ in scenario.genes}
    wanted = set(genome.keys)
    if found != wanted:
        raise ScenarioError(
            f"scenario on map {scenario.map!r}: missing genes {sorted(wanted - found)}, "
            f"unknown genes {sorted(found - wanted)}; expected exactly those of the genome"
        )
    return _checked(np.array([scenario[key] for key in genome.keys]), genome)


def decode(vector: NDArray[np.float64], genome: Genome, *, map: str, seed: int) -> Scenario:
    """Return the scenario that a chromosome stands for; the inverse of :func:`encode`."""
    values = _checked(np.asarray(vector, dtype=np.float64), genome)
    genes = tuple((key, float(value)) for key, value in zip(genome.keys, values, strict=True))
    return Scenario(map=map, seed=seed, genes=genes, task=genome.task)


def _checked(vector: NDArray[np.float64], genome: Genome) -> NDArray[np.float64]:
    if vector.shape != (genome.size,):
        raise ScenarioError(
            f"chromosome: found shape {vector.shape}, expected ({genome.size},) for this genome"
        )
    for item, value in zip(genome.properties, vector, strict=True):
        if not math.isfinite(value) or not item.low <= value <= item.high:
            raise ScenarioError(
                f"gene {item.key!r}: found {value}, expected {item.low} to {item.high} "
                f"({item.meaning})"
            )
    return vector
