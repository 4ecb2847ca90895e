"""Genes that are off by default: each with its range, and its meaning in physical units.

A scenario without the gene has its nominal value.  A search uses an extra gene if its method puts
it into the genome: ``Genome(composites=(*plan.genome.composites, WIND))``.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from pytest_garl.scenarios.genes import (
    CompositeGene,
    Genome,
    genome_for,
    place_gene,
    with_destinations,
)
from pytest_garl.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from pytest_garl.scenarios.maps.map import Map

TOP_WIND_MPS = 10.0
"""The DJI Matrice 100's rated wind resistance."""
WIND = CompositeGene(
    name="wind", genes=(place_gene("wind", "wind", "wind as a share of 10 m/s, towards"),)
)

TOP_GPS_ERROR_M = 2.5
"""Horizontal accuracy (CEP) that u-blox states for its M8 receivers; here a bound per axis."""
GPS_ERROR = CompositeGene(
    name="gps_error",
    genes=(place_gene("gps_error", "gps_error", "error of the GPS position, share of 2.5 m"),),
)

EXTRAS = {gene.name: gene for gene in (WIND, GPS_ERROR)}


def wind_mps(scenario: Scenario) -> tuple[float, float]:
    """Return the wind's velocity (x, y)."""
    return (
        scenario.get("wind.x", 0.0) * TOP_WIND_MPS,
        scenario.get("wind.y", 0.0) * TOP_WIND_MPS,
    )


def gps_error_m(scenario: Scenario) -> tuple[float, float]:
    """Return the error (x, y) of the coordinate in the mission."""
    return (
        scenario.get("gps_error.x", 0.0) * TOP_GPS_ERROR_M,
        scenario.get("gps_error.y", 0.0) * TOP_GPS_ERROR_M,
    )


def genome_like(keys: Iterable[str], map: Map) -> Genome:
    """Return the genome, weather in its full range, of scenarios that have these genes.

    Whatever is not there by default is part of it if one of the keys is.
    """
    keys = tuple(keys)
    heads = {key.partition(".")[0] for key in keys}
    extras = [gene for name, gene in EXTRAS.items() if name in heads]
    genome = genome_for(map, weather="full", extras=extras)
    bound = any(".destination_" in key for key in keys)
    return with_destinations(genome) if bound else genome
