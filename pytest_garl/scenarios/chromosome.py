"""Scenario to chromosome and back.

Both hold gene units.  A chromosome has a value for every property of its genome, a scenario only
those of what is there and is not nominal.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.genes import CLEAR, OFF, ON, Genome, NuclearGene, active_genes
from pytest_garl.scenarios.groups import QUANTITIES
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY

ROUNDING_SHARE = 1e-3
"""Values of scenarios are rounded to what a file can write, by less than this share of a range."""


def encode(scenario: Scenario, genome: Genome) -> NDArray[np.float64]:
    """Return the scenario's values in the genome's order, shape (size,).

    :func:`decode` gives the scenario back.  Raises ScenarioError for a scenario that the genome
    cannot express.
    """
    known = dict(scenario.genes)
    allowed = CLEAR | dict(genome.fixed)
    unknown = sorted(
        key for key in known.keys() - {*genome.keys} if known[key] != allowed.get(key, math.nan)
    )
    objects = [gene for gene in genome.genes if _is_object(gene)]
    gone = {gene.name for gene in objects if gene.name in scenario.removed_objects}
    missing = sorted(
        item.key
        for gene in genome.genes
        for item in gene.values
        if item.key not in known and item.key not in QUANTITIES and gene.name not in gone
    )
    if missing or unknown:
        raise ScenarioError(
            f"scenario on map {scenario.map!r}: missing genes {missing}, "
            f"unknown genes {unknown}; expected exactly those of the genome"
        )
    row: list[float] = []
    for gene in genome.genes:
        values = [
            item.nominal
            if gene.name in gone
            else _value(gene, item, known.get(item.key, item.nominal))
            for item in gene.values
        ]
        if gene.is_optional:
            nominal = [item.nominal for item in gene.values]
            acts = gene.name not in gone if _is_object(gene) else values != nominal
            row.append(ON if acts else OFF)
        row += values
    return _checked(_without_rounding(np.array(row), genome), genome)


def decode(vector: NDArray[np.float64], genome: Genome, *, map: str, seed: int) -> Scenario:
    """Return the scenario that a chromosome, (number of genes,), stands for.

    Raises ScenarioError for another shape, and for a gene beyond its range.
    """
    row = dict(
        zip(genome.keys, _checked(np.asarray(vector, dtype=np.float64), genome), strict=True)
    )
    values, removed = dict(CLEAR), [*genome.removed]
    active = active_genes(genome, row, seed)
    for gene in genome.genes:
        if not gene.is_optional or gene.name in active:
            values |= {item.key: float(row[item.key]) for item in gene.values}
        elif _is_object(gene):
            removed.append(gene.name)
    conditions = {key: value for key, value in values.items() if key in QUANTITIES}
    scenario = Scenario(
        map=map,
        seed=seed,
        genes=tuple((key, value) for key, value in values.items() if key not in QUANTITIES),
        removed_objects=tuple(sorted(removed)),
        task=genome.task,
    )
    return scenario.replace(conditions | dict(genome.fixed))


def _without_rounding(vector: NDArray[np.float64], genome: Genome) -> NDArray[np.float64]:
    """Return the ends of ranges for values beyond them by what files round."""
    inside = np.clip(vector, genome.lower, genome.upper)
    is_rounding = np.abs(inside - vector) <= ROUNDING_SHARE * (genome.upper - genome.lower)
    return np.where(is_rounding, inside, vector)


def _value(gene: NuclearGene, item: Quantity, value: float) -> float:
    """Return a value; in a story, one that does not count may lie outside of the range."""
    if _is_object(gene) and item.key.partition(".")[2] in STORY:
        return min(item.high, max(item.low, value))
    return value


def _is_object(gene: NuclearGene) -> bool:
    return any(item.key == f"{gene.name}.velocity" for item in gene.properties)


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
