from __future__ import annotations

import dataclasses
import itertools
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl import (
    Abort,
    Command,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.landing_system import Airframe
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import GPS_ERROR, WIND, genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.methods.random import propose
from pytest_garl.simulation.flight_file import load, save
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot

LAWN = load_map("lawn")
EMPTY = dataclasses.replace(LAWN, objects=())
STAND = policy_spec("stationary")


def nominal(**genes: float) -> Any:
    genome = genome_for(EMPTY, extras=[WIND, GPS_ERROR])
    scenario = decode(genome.nominal, genome, map="lawn", seed=5)
    values = {key.replace("__", "."): value for key, value in genes.items()}
    return repair(scenario.replace(values), EMPTY)


class Scripted:
    airframe = Airframe(latency_s=0.0)
    needs_camera = False

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m

    def hover(self, height: float) -> PositionSetpoint:
        return PositionSetpoint(position_m=(self.home[0], self.home[1], height))


class Hops(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(2.0) if observation.time_s < 4 else Land()


class Falls(Scripted):
    def step(self, observation: Observation) -> Command:
        if observation.time_s < 5:
            return self.hover(6.0)
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, -4.0))


class HitsATree(Scripted):
    def step(self, observation: Observation) -> Command:
        if observation.time_s < 3:
            return self.hover(2.0)
        return PositionSetpoint(position_m=(4.6, 4.2, 2.0))


class Hovers(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(3.0)


class GivesUp(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(3.0) if observation.time_s < 3 else Abort()


class Raises(Scripted):
    def step(self, observation: Observation) -> Command:
        raise ZeroDivisionError("no plan")


class ReturnsNan(Scripted):
    def step(self, observation: Observation) -> Command:
        return VelocitySetpoint(velocity_mps=(math.nan, 0.0, 0.0))


class ReturnsNothing(Scripted):
    def step(self, observation: Observation) -> None:
        return None


class WrongShape(Scripted):
    def step(self, observation: Observation) -> Command:
        return VelocitySetpoint(velocity_mps=(0.0, 0.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("system", "outcome"),
    [
        (Hops, "landed"),
        (Falls, "collision"),
        (HitsATree, "collision"),
        (Hovers, "not_landed"),
        (GivesUp, "aborted"),
        (Raises, "crashed"),
        (ReturnsNan, "crashed"),
    ],
)
def test_each_outcome_of_the_table_can_happen(system: type, outcome: str) -> None:
    flight = fly(nominal(), system, STAND, map=EMPTY, time_limit_s=20)
    assert flight.outcome == outcome


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


@pytest.mark.parametrize(
    ("system", "kind", "words"),
    [
        (Raises, "raised", "no plan"),
        (ReturnsNan, "nonsense", "velocity_mps = (nan"),
        (ReturnsNothing, "nonsense", "step returned None"),
        (WrongShape, "nonsense", "expected 3 finite numbers"),
    ],
)
def test_a_broken_system_is_recorded(system: type, kind: str, words: str) -> None:
    flight = fly(nominal(), system, STAND, map=EMPTY, time_limit_s=5)
    assert flight.crash is not None
    assert flight.crash.kind == kind
    assert words in flight.crash.message
    assert system.__name__ in flight.crash.where or "step" in flight.crash.where


def test_the_vehicle_holds_its_place_in_wind() -> None:
    flight = fly(nominal(wind__x=0.5), Hovers, STAND, map=EMPTY, time_limit_s=20)
    late = flight.uav.position_m[flight.uav.time_s > 12]
    error = np.linalg.norm(late - np.array([0.0, -16.5, 3.0]), axis=1)
    assert error.max() < 0.2


def test_a_step_in_position_does_not_overshoot() -> None:
    flight = fly(nominal(), Hovers, STAND, map=EMPTY, time_limit_s=15)
    assert flight.uav.position_m[:, 2].max() < 3.0 + 0.05 * 2.8
    assert flight.uav.position_m[-1, 2] == pytest.approx(3.0, abs=0.1)


def test_the_same_scenario_flies_the_same_bytes() -> None:
    scenario = propose(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    first = fly(scenario, Hops, policy_spec("random_walk"), time_limit_s=10)
    again = fly(scenario, Hops, policy_spec("random_walk"), time_limit_s=10)
    assert first.sha256 == again.sha256
    assert (first.uav.position_m == again.uav.position_m).all()


def test_who_stays_at_home_changes_nothing_for_the_others() -> None:
    scenario = propose(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    names = [name for name, _ in LAWN.object_names]
    alone = scenario.without(*names[:-1])
    first, second = (
        fly(each, ReferencePilot, policy_spec("waypoint"), time_limit_s=3.0)
        for each in (scenario, alone)
    )
    assert [item.name for item in second.objects] == names[-1:]
    assert np.array_equal(first.objects[-1].track.position_m, second.objects[-1].track.position_m)


def test_another_process_flies_the_same_bytes() -> None:
    code = (
        "from tests.simulation.test_flight import *\n"
        "scenario = propose(LAWN, genome_for(LAWN), 3, 0, 1)[0]\n"
        "print(fly(scenario, Hops, policy_spec('waypoint'), time_limit_s=10).sha256)\n"
    )
    root = Path(__file__).parents[2]
    other = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root
    )
    scenario = propose(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    here = fly(scenario, Hops, policy_spec("waypoint"), time_limit_s=10)
    assert other.stdout.strip() == here.sha256


def test_a_flight_survives_its_file(tmp_path: Path) -> None:
    scenario = propose(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    flight = fly(scenario, ReferencePilot, policy_spec("waypoint"), time_limit_s=5)
    save(flight, tmp_path / "flight.npz")
    back = load(tmp_path / "flight.npz")
    for name in ("outcome", "sha256", "events", "steps", "contacts", "separations", "decoys"):
        assert getattr(back, name) == getattr(flight, name)
    assert (back.uav.position_m == flight.uav.position_m).all()
    assert (back.objects[0].moves == flight.objects[0].moves).all()


@pytest.mark.parametrize("policy", ["waypoint", "random_walk"])
def test_objects_keep_their_limits_and_out_of_solids(policy: str) -> None:
    scenario = propose(LAWN, genome_for(LAWN), 11, 0, 1)[0]
    top = {key: 1.0 for key, _ in scenario.genes if key.endswith("velocity")}
    flight = fly(scenario.replace(top), Hovers, policy_spec(policy), time_limit_s=40)
    trunks = [(body.position_m, body.parts[0].size_m[0] / 2) for body in LAWN.bodies]
    for item in flight.objects:
        kind = OBJECT_TYPES[item.type]
        speed = np.linalg.norm(item.track.velocity_mps[:, :2], axis=1)
        assert speed.max() <= kind.top_speed_mps + 1e-9
        assert speed.max() > 0.3
        steps = np.diff(item.track.position_m[:, :2], axis=0)
        assert np.linalg.norm(steps, axis=1).max() <= kind.top_speed_mps * 2 / 24
        if kind.altitude_m == 0:
            for (x, y, _), radius in trunks:
                away = np.hypot(item.track.position_m[:, 0] - x, item.track.position_m[:, 1] - y)
                assert away.min() > radius


@pytest.mark.parametrize("policy", ["greedy", "stand", "dqn"])
def test_objects_that_all_want_to_be_in_one_place_keep_out_of_each_other(policy: str) -> None:
    scenario = propose(LAWN, genome_for(LAWN), 11, 0, 1)[0]
    top = {key: 1.0 for key, _ in scenario.genes if key.endswith("velocity")}
    flight = fly(scenario.replace(top), Hovers, policy_spec(policy), time_limit_s=20)
    gaps = []
    for one, other in itertools.combinations(flight.objects, 2):
        kinds = OBJECT_TYPES[one.type], OBJECT_TYPES[other.type]
        if kinds[0].altitude_m == kinds[1].altitude_m:
            away = one.track.position_m[:, :2] - other.track.position_m[:, :2]
            radii = kinds[0].radius_m + kinds[1].radius_m
            gaps.append(np.linalg.norm(away, axis=1).min() - radii)
    assert min(gaps) > -0.02
    if policy != "dqn":
        assert min(gaps) < 0.1


@pytest.mark.sim
@pytest.mark.parametrize("name", ["court", "lawn"])
def test_the_reference_pilot_lands_where_it_can_be_done(name: str) -> None:
    map = load_map(name)
    landed = 0
    for scenario in propose(map, genome_for(map), 21, 0, 10):
        flight = fly(scenario, ReferencePilot, STAND)
        landed += flight.outcome == "landed" and flight.final_distance_m < 0.5
    assert landed >= 9
