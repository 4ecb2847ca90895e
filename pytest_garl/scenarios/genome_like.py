"""Genomes that have what given genes ask for: conditions, stories and destinations of NPCs."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import TYPE_CHECKING

from pytest_garl.scenarios.genes import (
    Genome,
    NuclearGene,
    end_of_way,
    genome_for,
    group_gene,
    within,
)
from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.story import STORY, StoryValue

if TYPE_CHECKING:
    from pytest_garl.scenarios.maps.map import Map


def genome_like(keys: Iterable[str], map: Map) -> Genome:
    """Return the genome, weather in its full range, of scenarios that have these genes.

    Whatever is not there by default is part of it if one of the keys is.
    """
    keys = tuple(keys)
    heads = {key.partition(".")[0] for key in keys}
    extras = [group_gene(group) for name, group in GROUPS.items() if name in heads]
    genome = genome_for(map, weather="full", extras=extras)
    if any(key.endswith(".grade") for key in keys):
        genome = with_values_of(genome, keys)
    bound = any(".destination_" in key for key in keys)
    return with_destinations(genome) if bound else genome


def with_values_of(genome: Genome, keys: tuple[str, ...]) -> Genome:
    """Return the genome with those values of NPCs' stories that are named, as they can be flown."""
    composites = (
        dataclasses.replace(
            each, genes=tuple(_with_story(gene, {*keys} - {*genome.keys}) for gene in each.genes)
        )
        if each.name == "objects"
        else each
        for each in genome.composites
    )
    return dataclasses.replace(genome, composites=tuple(composites))


def _with_story(gene: NuclearGene, keys: set[str]) -> NuclearGene:
    told = tuple(
        story_property(gene.name, each, (each.quantity.low, each.quantity.high))
        for each in STORY.values()
        if f"{gene.name}.{each.name}" in keys
    )
    return dataclasses.replace(gene, properties=(*gene.properties, *told))


def story_property(name: str, value: StoryValue, limits: tuple[float, float]) -> Quantity:
    """Return the property of one value of an NPC's story."""
    return within(value.quantity, *limits, key=f"{name}.{value.name}")


def with_destinations(genome: Genome) -> Genome:
    """Return the genome with a destination (x, y) for each NPC.

    The destination belongs to the NPC's nuclear gene, so start and destination are inherited
    together.
    """
    composites = (
        dataclasses.replace(each, genes=tuple(_with_destination(gene) for gene in each.genes))
        if each.name == "objects"
        else each
        for each in genome.composites
    )
    return dataclasses.replace(genome, composites=tuple(composites))


def _with_destination(gene: NuclearGene) -> NuclearGene:
    return dataclasses.replace(
        gene, properties=(*gene.properties, *end_of_way(gene.name, "destination"))
    )
