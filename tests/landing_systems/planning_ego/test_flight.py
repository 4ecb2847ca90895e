from __future__ import annotations

import dataclasses
import math

import pytest

from landing_systems.modules.planning_ego import LANDING, EgoPlanner
from pytest_garl import Airframe, Command, Mission, Observation, PositionSetpoint, VelocitySetpoint
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.bodies import Body
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.static_bodies import box, tree
from pytest_garl.simulation.fly import fly

FOLLOWING_P = 1.0
ABOVE, TARGET = (4.0, 8.0, 10.0), (4.0, 1.0, 2.0)


class Follows:
    """Climbs, crosses a wall high above it, and descends back to its other side."""

    airframe = Airframe()

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m
        self.planner = EgoPlanner(LANDING, mission.camera, mission.gps_position_m)
        self.goals = [ABOVE, TARGET]
        self.climbed = False

    def step(self, observation: Observation) -> Command:
        self.planner.observe(observation)
        position, velocity = observation.position_m, observation.velocity_mps
        self.climbed |= bool(position[2] > 9.5)
        if not self.climbed:
            return PositionSetpoint(position_m=(self.home[0], self.home[1], 10.0))
        self.planner.set_goal(self.goals[0])
        setpoint = self.planner.plan(observation.time_s, position, velocity)
        if setpoint.reached and len(self.goals) > 1:
            self.goals.pop(0)
        vx, vy, vz = (
            speed + FOLLOWING_P * (aim - at)
            for speed, aim, at in zip(
                setpoint.velocity_mps, setpoint.position_m, position, strict=True
            )
        )
        return VelocitySetpoint(velocity_mps=(vx, vy, vz))


def flight_among(*bodies: Body) -> Flight:
    map = dataclasses.replace(load_map("lawn"), objects=(), bodies=bodies)
    genome = genome_for(map)
    scenario = decode(genome.nominal, genome, map="lawn", seed=3)
    return fly(scenario, Follows, policy_spec("stationary"), map=map, time_limit_s=36.0)


@pytest.mark.sim
def test_it_descends_beside_trees_and_a_wall_in_the_real_simulator() -> None:
    bodies = (
        Body(
            name="tree-1",
            kind="tree",
            position_m=(0.0, 4.0, 0.0),
            parts=tree(height_m=8.0, crown_m=4.0),
        ),
        Body(
            name="wall-1",
            kind="box",
            position_m=(4.0, 4.5, 0.0),
            parts=box(x_m=4.0, y_m=0.5, height_m=6.0),
        ),
    )
    flight = flight_among(*bodies)
    assert not flight.contacts
    assert math.dist(flight.uav.position_m[-1], TARGET) < 0.5
    assert min(item.distance_m for item in flight.separations) > 0.1
