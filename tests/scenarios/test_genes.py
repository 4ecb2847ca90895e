"""The genome of a map: which genes there are, and their ranges."""

from __future__ import annotations

from pytest_garl.scenarios.genes import genome_for, group_gene
from pytest_garl.scenarios.genome_like import genome_like, with_destinations
from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.scenarios.maps.loading import load_map

COURT = load_map("court")


def test_weather_is_confined_unless_the_full_range_is_asked_for() -> None:
    confined, full = genome_for(COURT), genome_for(COURT, weather="full")
    assert confined.upper[confined.keys.index("environment.fog")] == 0.15
    assert full.upper[full.keys.index("environment.fog")] == 1.0
    assert confined.upper[confined.keys.index("environment.sun_position")] == 1.0


def test_borders_fall_between_nuclear_genes() -> None:
    genome = genome_for(COURT, extras=[group_gene(GROUPS["wind"])])
    starts = {genome.keys.index(gene.properties[0].key) for gene in genome.genes}
    assert set(genome.borders) == starts - {0}


def test_the_genome_of_scenarios_is_known_by_their_keys() -> None:
    plain = genome_for(COURT, weather="full")
    assert genome_like(plain.keys, COURT) == plain
    extras = [group_gene(each) for each in GROUPS.values()]
    whole = with_destinations(genome_for(COURT, weather="full", extras=extras))
    assert genome_like(whole.keys, COURT) == whole
