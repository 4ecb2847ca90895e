from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import numpy as np
import pytest

from landing_systems.mm_mls import MultiModuleLandingSystem
from landing_systems.tphyolo_mls import TphYoloLandingSystem
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.fly import fly

pytestmark = pytest.mark.sim


def place(objects: tuple[tuple[str, int], ...] = (), **genes: float) -> tuple[Map, Scenario]:
    map = dataclasses.replace(load_map("lawn"), objects=objects)
    genome = genome_for(map)
    scenario = decode(genome.nominal, genome, map="lawn", seed=3)
    changes = {key.replace("__", "."): value for key, value in genes.items()}
    return map, repair(scenario.replace(changes), map)


def phases(flight: Flight) -> list[str]:
    """Name the phases in their order."""
    names = [step.diagnostics.phase for step in flight.steps if step.diagnostics]
    return [name for name, before in zip(names, ["", *names], strict=False) if name != before]


@pytest.fixture(scope="module")
def undisturbed() -> Callable[[type], Flight]:
    """Return a function that flies a landing system where nothing is in its way, once."""

    @functools.cache
    def flown(system: type) -> Flight:
        map, scenario = place(marker__x=0.3, marker__y=-0.4)
        return fly(scenario, system, policy_spec("stationary"), map=map)

    return flown


@pytest.mark.parametrize("system", [TphYoloLandingSystem, MultiModuleLandingSystem])
def test_it_lands_on_the_marker_where_nothing_is_in_the_way(
    system: type, undisturbed: Callable[[type], Flight]
) -> None:
    flight = undisturbed(system)
    assert flight.outcome == "landed"
    assert flight.final_distance_m < 0.3
    assert phases(flight)[-2:] == ["descend", "commit"]


def test_mm_shows_its_planned_path(undisturbed: Callable[[type], Flight]) -> None:
    flight = undisturbed(MultiModuleLandingSystem)
    planned = [step.diagnostics.planned_path_m for step in flight.steps if step.diagnostics]
    assert max(len(path) for path in planned) > 5


def test_mm_gives_way_to_a_person_on_the_marker() -> None:
    map, scenario = place((("person", 1),), **{"person-1.velocity": 0.9})
    flight = fly(scenario, MultiModuleLandingSystem, policy_spec("stand"), map=map)
    assert flight.outcome in ("gave_up", "not_landed")
    assert all(contact.body == "ground" for contact in flight.contacts)
    near = np.linalg.norm(flight.uav.position_m[:, :2] - flight.marker_position_m, axis=1) < 1.0
    airborne = flight.uav.time_s > 10.0
    assert flight.uav.position_m[near & airborne, 2].min() > 2.0


def test_the_same_flight_has_the_same_bytes() -> None:
    map, scenario = place((("dog", 1),), **{"dog-1.velocity": 0.5})
    first, again = (
        fly(scenario, MultiModuleLandingSystem, policy_spec("waypoint"), map=map, time_limit_s=20)
        for _ in range(2)
    )
    assert first.sha256 == again.sha256
