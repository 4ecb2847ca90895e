"""One episode of the surrogate: a landing whose NPCs are moved from outside."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pytest_garl.flight.flight import Flight, Outcome
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.bodies import discs_of
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import UAV_CLEARANCE_M, Placed, start_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.loop import Loop
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, Situation
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from pytest_garl.simulation.randomness import generator

TIME_LIMIT_S = 60.0
UAV_START_M = (4.0, 20.0)
"""Least and largest distance from the marker at which the UAV starts."""
_TICKS = round(DECISION_STEP_S * PHYSICS_RATE_HZ)
_TRIES = 1000


class _MovedFromOutside:
    """A policy that makes the move that the episode sets."""

    def __init__(self) -> None:
        self.move = STAY

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        self.move = STAY

    def decide(self, situation: Situation) -> Move:
        return self.move


class Episode:
    """A landing on the project's own simulator, advanced one decision at a time."""

    def __init__(
        self,
        scenario: Scenario,
        map: Map,
        pilot: Callable[[], Any],
        *,
        camera: Camera | None = None,
        time_limit_s: float = TIME_LIMIT_S,
    ) -> None:
        self.outcome: Outcome | None = None
        placed = Placed(scenario, map)
        self._loop = Loop(placed, pilot, _MovedFromOutside, time_limit_s, None)
        self._loop.begin()
        self._names = [npc.name for npc in self._loop.npcs]
        self._renderer = (
            Renderer(placed, camera, generator(scenario.seed, "sensor"), colour=False)
            if camera
            else None
        )

    @property
    def situations(self) -> tuple[Situation, ...]:
        """The situation of each NPC."""
        return tuple(self._loop.situation(npc) for npc in self._loop.npcs)

    @property
    def hit(self) -> str | None:
        """Name of the NPC that the UAV collided with, if it did."""
        if self.outcome != "collision":
            return None
        body = self._loop.recorder.last_contact
        return body if body in self._names else None

    @property
    def record(self) -> Flight:
        """The record so far, without hash and versions."""
        return self._loop.recorder.flight(self.outcome or "inconclusive", None, ())

    def step(self, moves: Sequence[Move]) -> None:
        """Let the NPCs go where ``moves`` say until the next decision, or the end."""
        for npc, move in zip(self._loop.npcs, moves, strict=True):
            npc.policy.move = move  # type: ignore[attr-defined]
        for _ in range(_TICKS):
            self.outcome = self._loop.tick()
            if self.outcome is not None:
                return
        if self._loop.out_of_time:
            # End it here: one more decision would move nothing.
            self.outcome = self._loop.tick()

    def marker_pixels(self) -> tuple[int, int]:
        """Return S_gt and S_d: the marker's pixels with nothing in front, and those seen."""
        if self._renderer is None:
            return 0, 0
        eye, attitude = self._loop.eye()
        poses = [(npc.position_m, npc.yaw_rad) for npc in self._loop.npcs]
        frame = self._renderer.render(eye, attitude, 0.0, poses)
        marker = self._renderer.segment_ids["marker"]
        return self._renderer.marker_pixels(eye, attitude), int(frame.pixels[marker])

    def close(self) -> None:
        """Free the physics."""
        self._loop.close()


def draw_episode(map: Map, types: Sequence[str], rng: np.random.Generator) -> tuple[Scenario, Map]:
    """Draw the starts of NPCs of these types and of the UAV; the marker is at its GPS coordinate.

    Weather is clear, and each NPC has its own speed, as in scenarios of a search.
    """
    counts = {type_name: list(types).count(type_name) for type_name in dict.fromkeys(types)}
    place = dataclasses.replace(
        map, objects=tuple(counts.items()), uav_start_m=_uav_start(map, rng)
    )
    genome = genome_for(place)
    scenario = decode(genome.nominal, genome, map=map.name, seed=int(rng.integers(2**32)))
    x_min, x_max, y_min, y_max = map.bounds_m
    for name, _ in place.present_objects:
        start = (float(rng.uniform(x_min, x_max)), float(rng.uniform(y_min, y_max)))
        low, high = next((p.low, p.high) for p in genome.properties if p.key == f"{name}.velocity")
        scenario = scenario.replace(
            {**start_genes(name, start, place), f"{name}.velocity": float(rng.uniform(low, high))}
        )
    return repair(scenario, place), place


def in_any_environment(scenario: Scenario, map: Map, rng: np.random.Generator) -> Scenario:
    """Return the scenario with weather, light and marker drawn as in a search."""
    drawn = {
        item.key: float(rng.uniform(item.low, item.high))
        for item in genome_for(map).properties
        if item.key.startswith(("environment.", "marker."))
    }
    return repair(scenario.replace(drawn), map)


def _uav_start(map: Map, rng: np.random.Generator) -> tuple[float, float, float]:
    """Draw a start with nothing above it, around the marker."""
    discs = [disc for body in map.bodies for disc in discs_of(body)]
    x_min, x_max, y_min, y_max = map.bounds_m
    for _ in range(_TRIES):
        distance, angle = rng.uniform(*UAV_START_M), rng.uniform(0, 2 * math.pi)
        x = map.gps_position_m[0] + float(distance * math.cos(angle))
        y = map.gps_position_m[1] + float(distance * math.sin(angle))
        free = all(
            math.hypot(x - disc.x_m, y - disc.y_m) > disc.radius_m + UAV_CLEARANCE_M
            for disc in discs
        )
        if free and x_min < x < x_max and y_min < y < y_max:
            return x, y, map.uav_start_m[2]
    return map.uav_start_m
