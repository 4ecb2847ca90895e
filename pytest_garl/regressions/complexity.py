"""The complexity of a scenario: what shrinking lowers."""

from __future__ import annotations

from pytest_garl.scenarios.extra_genes import genome_like
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario

OBJECT_PLACES = ("start_x", "start_y", "destination_x", "destination_y")
"""Genes whose distance from nominal is not counted: no place of an object is simpler than another;
only their digits count."""


def genome_of(scenario: Scenario, map: Map) -> Genome:
    """Return the genome of a scenario's own genes, weather in its full range."""
    return genome_like((key for key, _ in scenario.genes), map)


def complexity(scenario: Scenario, genome: Genome) -> tuple[int, int, float, int]:
    """Return the number of objects, of genes off nominal, their distance from it, and digits."""
    present = dict(scenario.genes)
    off, distance = 0, 0.0
    for gene in genome.genes:
        shares = [
            abs(present[item.key] - item.nominal) / (item.high - item.low)
            for item in gene.properties
            if item.key in present and not item.key.endswith(OBJECT_PLACES)
        ]
        off += any(share > 0 for share in shares)
        distance += sum(shares)
    objects = sum(key.endswith(".velocity") for key in present)
    digits = sum(len(repr(value)) for value in present.values())
    return objects, off, round(distance, 2), digits
