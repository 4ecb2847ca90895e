"""What contacts with bodies mean, before and after the motors stopped."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_garl import Command, Land, Observation
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.placed import start_genes
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from tests.support.engines import engine
from tests.support.flights import EMPTY, LAWN, STAND, Falls, HitsATree, Scripted, nominal

__all__ = ["engine"]
pytestmark = pytest.mark.usefixtures("engine")

DOG = dataclasses.replace(LAWN, objects=(("dog", 1),))
LANDS_AT_S = 4.0
"""From 2 m the UAV touches down 3.85 s later, and its motors stop after another 1.4 s."""


class Lands(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(2.0) if observation.time_s < LANDS_AT_S else Land()


def flight_with_a_dog(arrival_s: float) -> Flight:
    """Fly with a dog that runs through the place of the UAV at about ``arrival_s``."""
    genome = genome_for(DOG)
    scenario = decode(genome.nominal, genome, map="lawn", seed=5)
    start_m = (-6.0, DOG.uav_start_m[1])
    place = {**start_genes("dog-1", start_m, DOG), "dog-1.velocity": 1.0}
    # It needs 1.7 s for 6 m.
    moves = [(0.0, 0.0)] * round((arrival_s - 1.7) / DECISION_STEP_S) + [(1.0, 0.0)] * 20
    policy = recorded_spec({"dog-1": tuple(moves)}, {})
    return fly(scenario.replace(place), Lands, policy, map=DOG, time_limit_s=20)


def test_a_collision_names_the_body_and_ends_the_flight() -> None:
    flight = fly(nominal(), HitsATree, STAND, map=EMPTY, time_limit_s=40)
    assert flight.contacts[-1].body == "tree-1"
    assert flight.contacts[-1].body_class == "static"
    assert flight.elapsed_s == pytest.approx(flight.contacts[-1].time_s)
    assert min(gap.distance_m for gap in flight.separations) == 0.0


def test_a_hard_touchdown_is_a_collision_with_the_ground() -> None:
    flight = fly(nominal(), Falls, STAND, map=EMPTY, time_limit_s=20)
    assert flight.contacts[-1].body == "ground"
    assert flight.contacts[-1].speed_mps > 2.0


def test_dog_that_hits_the_uav_before_its_motors_stopped_is_a_collision() -> None:
    flight = flight_with_a_dog(8.5)
    assert flight.outcome == "collision"
    assert [contact.body for contact in flight.contacts] == ["ground", "dog-1"]
    assert flight.touchdown is not None
    assert flight.touchdown.stopped_s is None


def test_dog_that_pushes_the_landed_uav_is_no_violation() -> None:
    flight = flight_with_a_dog(10.0)
    assert flight.touchdown is not None
    assert flight.touchdown.stopped_s is not None
    hit = flight.contacts[-1]
    assert (hit.body, flight.outcome) == ("dog-1", "landed")
    assert hit.time_s > flight.touchdown.stopped_s
    assert flight.touchdown.slid_m < 0.1
    # Where the dog pushes it to is not where it landed; the distance to the dog counts until the
    # motors stopped.
    assert flight.elapsed_s == hit.time_s
    assert np.linalg.norm(flight.uav.position_m[-1][:2] - flight.touchdown.position_m[:2]) < 0.1
    assert all(gap.distance_m > 0.5 for gap in flight.separations if gap.body == "dog-1")
