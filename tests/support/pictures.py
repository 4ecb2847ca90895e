"""Renderers of scenarios with chosen genes, and the frames that they draw."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera.renderer import Renderer

CAMERA = Camera()


NONE: Mapping[str, float] = MappingProxyType({})


LEVEL = (0.0, 0.0, 0.0, 1.0)


def renderer(
    name: str = "lawn",
    seed: int = 0,
    camera: Camera = CAMERA,
    genes: Mapping[str, float] = NONE,
    *,
    colour: bool = True,
) -> tuple[Renderer, Any]:
    map = dataclasses.replace(load_map(name), objects=(("person", 1), ("dog", 1), ("bird", 1)))
    genome = genome_for(map, weather="full")
    scenario = decode(genome.nominal, genome, map=name, seed=seed)
    scenario = repair(scenario, map)
    scenario = scenario.replace({f"environment.{key}": value for key, value in genes.items()})
    return Renderer(Placed(scenario, map), camera, np.random.default_rng(seed), colour=colour), map


def poses(x: float, y: float) -> list[tuple[tuple[float, float, float], float]]:
    return [((x + 1.5, y, 0.0), 0.4), ((x - 1.6, y + 0.8, 0.0), 2.0), ((x, y - 1.4, 3.0), 1.0)]
