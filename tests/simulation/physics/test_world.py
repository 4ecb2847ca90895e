"""What every physics engine must do, against closed-form cases: both fly by the same mechanics."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest

from pytest_garl import Airframe
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, GRAVITY_MPS2
from pytest_garl.scenarios.bodies import Body, Part, Shape, quaternion_of
from pytest_garl.simulation.physics.make_world import make_world
from pytest_garl.simulation.physics.vehicle import Vector, vehicle_model
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ, World
from tests.support.engines import engine

__all__ = ["engine"]
pytestmark = [pytest.mark.sim, pytest.mark.usefixtures("engine")]

MODEL = vehicle_model(Airframe())
WEIGHT_N = MODEL.mass_kg * GRAVITY_MPS2
STEP_S = 1 / PHYSICS_RATE_HZ
NOTHING = (0.0, 0.0, 0.0)
LEVEL = (0.0, 0.0, 0.0, 1.0)
HALF_SPAN_M = MODEL.size_m / 2
HALF_GEAR_M = 0.18 * MODEL.size_m
WITHIN = {"bullet": 0.05, "mujoco": 0.15}
"""How exact the friction of a sliding UAV is: in MuJoCo it hops a little."""


def solid(shape: Shape, size_m: Vector, at_m: Vector, name: str = "thing") -> Body:
    part = Part(shape=shape, size_m=size_m, position_m=(0.0, 0.0, size_m[2] / 2))
    return Body(name=name, kind="thing", parts=(part,), position_m=at_m)


WALL = solid("box", (0.2, 8.0, 4.0), (3.0, 0.0, 0.0), "wall")


@contextmanager
def world_with(
    bodies: Sequence[Body] = (), objects: Sequence[Body] = (), friction: float = 0.5
) -> Iterator[World]:
    world = make_world(MODEL, NOTHING, bodies, objects, friction)
    try:
        yield world
    finally:
        world.close()


def push(world: World, seconds: float, force: Vector = NOTHING, torque: Vector = NOTHING) -> None:
    for _ in range(round(seconds * PHYSICS_RATE_HZ)):
        world.step(world.uav_state()[0], force, torque)


def test_a_body_falls_by_gravity_alone() -> None:
    with world_with() as world:
        world.place_uav((1.0, 2.0, 20.0), LEVEL)
        push(world, 1.0)
        position, attitude, velocity, spin = world.uav_state()
    # A semi-implicit step first changes the velocity, then the place.
    n = PHYSICS_RATE_HZ
    fallen_m = GRAVITY_MPS2 * STEP_S**2 * n * (n + 1) / 2
    assert position == pytest.approx((1.0, 2.0, 20.0 - fallen_m), abs=1e-6)
    assert velocity == pytest.approx((0.0, 0.0, -GRAVITY_MPS2), abs=1e-6)
    assert attitude == pytest.approx(LEVEL)
    assert spin == pytest.approx(NOTHING)


def test_a_force_beside_the_centre_turns_the_body() -> None:
    arm_m, force_n = 0.3, 0.5
    with world_with() as world:
        world.place_uav((0.0, 0.0, 20.0), LEVEL)
        x, y, z = world.uav_state()[0]
        world.step((x, y + arm_m, z), (0.0, 0.0, force_n), NOTHING)
        _, _, velocity, spin = world.uav_state()
    assert velocity[2] == pytest.approx((force_n / MODEL.mass_kg - GRAVITY_MPS2) * STEP_S)
    assert spin == pytest.approx((arm_m * force_n / MODEL.inertia[0] * STEP_S, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_torque_spins_the_body_by_its_inertia(axis: int) -> None:
    torque = [0.0, 0.0, 0.0]
    torque[axis] = 0.01
    with world_with() as world:
        world.place_uav((0.0, 0.0, 20.0), LEVEL)
        push(world, 0.5, torque=(torque[0], torque[1], torque[2]))
        spin = world.uav_state()[3]
    assert spin[axis] == pytest.approx(0.5 * 0.01 / MODEL.inertia[axis], rel=1e-3)


def test_the_pose_in_which_a_body_is_placed_is_at_rest() -> None:
    pose = (1.0, -2.0, 5.0), quaternion_of(pitch_rad=0.3, yaw_rad=0.7)
    with world_with() as world:
        push(world, 0.2, (0.0, 0.0, 2 * WEIGHT_N))
        world.place_uav(*pose)
        position, attitude, velocity, spin = world.uav_state()
    assert position == pytest.approx(pose[0])
    assert attitude == pytest.approx(pose[1])
    assert velocity == pytest.approx(NOTHING)
    assert spin == pytest.approx(NOTHING)


def test_a_body_stands_on_its_feet_without_a_motion() -> None:
    with world_with() as world:
        push(world, 2.0)
        (x, y, z), attitude, velocity, _ = world.uav_state()
        touched = world.hull_contacts()
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-4)
    assert z == pytest.approx(BODY_ABOVE_FEET_M, abs=2e-3)
    assert attitude == pytest.approx(LEVEL, abs=1e-3)
    assert velocity == pytest.approx(NOTHING, abs=1e-3)
    assert [contact.body for contact in touched] == ["ground"]
    assert touched[0].position_m[2] == pytest.approx(0.0, abs=2e-3)
    assert abs(abs(touched[0].position_m[0]) - HALF_GEAR_M) < 0.02


@pytest.mark.parametrize("height_m", [0.05, 0.2, 0.5])
def test_a_body_that_is_dropped_does_not_rebound(height_m: float) -> None:
    with world_with() as world:
        world.place_uav((0.0, 0.0, BODY_ABOVE_FEET_M + height_m), LEVEL)
        fall_s = math.sqrt(2 * height_m / GRAVITY_MPS2)
        push(world, fall_s - 3 * STEP_S)
        assert not world.hull_contacts()
        assert world.uav_state()[2][2] == pytest.approx(-GRAVITY_MPS2 * fall_s, abs=0.2)
        rising, touched = [], []
        for _ in range(PHYSICS_RATE_HZ // 2):
            push(world, STEP_S)
            rising.append(world.uav_state()[2][2])
            touched.append([contact.body for contact in world.hull_contacts()])
        assert ["ground"] in touched[:6]
        assert world.uav_state()[0][2] == pytest.approx(BODY_ABOVE_FEET_M, abs=2e-3)
    # It may come out of the ground into which it sank in the step of the impact.
    assert max(rising) < 0.06 * GRAVITY_MPS2 * fall_s


@pytest.mark.parametrize("seed", range(6))
def test_a_body_that_falls_askew_comes_to_rest_and_gains_no_height(seed: int) -> None:
    draw = random.Random(seed)
    tilt_rad, yaw_rad = draw.uniform(-0.6, 0.6), draw.uniform(0.0, 6.0)
    start_m = BODY_ABOVE_FEET_M + draw.uniform(0.2, 0.6)
    heights = []
    with world_with(friction=draw.choice((0.35, 0.7))) as world:
        attitude = quaternion_of(pitch_rad=tilt_rad, yaw_rad=yaw_rad)
        world.place_uav((0.0, 0.0, start_m), attitude)
        push(world, STEP_S, (20.0, 10.0, 0.0), (1.0, 2.0, 0.5))
        for _ in range(5 * PHYSICS_RATE_HZ):
            push(world, STEP_S)
            heights.append(world.uav_state()[0][2])
        velocity = world.uav_state()[2]
    assert max(heights) <= start_m
    assert math.hypot(*velocity) < 0.02


@pytest.mark.parametrize("friction", [0.35, 0.5, 0.7])
def test_friction_holds_up_to_its_limit(friction: float) -> None:
    with world_with(friction=friction) as world:
        push(world, 0.5)
        push(world, 2.0, (0.9 * friction * WEIGHT_N, 0.0, 0.0))
        held_m = world.uav_state()[0][0]
    assert held_m == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("friction", [0.35, 0.5, 0.7])
def test_a_body_slides_by_what_a_force_exceeds_friction(engine: str, friction: float) -> None:
    force_n = 1.2 * friction * WEIGHT_N
    with world_with(friction=friction) as world:
        push(world, 0.5)
        push(world, 1.0, (force_n, 0.0, 0.0))
        begin_m, speed_mps = world.uav_state()[0][0], world.uav_state()[2][0]
        push(world, 1.0)
        slid_m, left_mps = world.uav_state()[0][0] - begin_m, world.uav_state()[2][0]
    within = WITHIN[engine]
    assert speed_mps == pytest.approx(0.2 * friction * GRAVITY_MPS2, rel=within)
    assert slid_m == pytest.approx(speed_mps**2 / (2 * friction * GRAVITY_MPS2), rel=within)
    assert left_mps == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize(("share", "tips"), [(0.8, False), (1.0, True)])
def test_a_body_tips_over_when_a_force_outweighs_its_stand(share: float, tips: bool) -> None:
    # About the edge of the gear: the weight at half its width against the force at its height.
    limit_n = WEIGHT_N * HALF_GEAR_M / BODY_ABOVE_FEET_M
    assert limit_n == pytest.approx(0.9 * WEIGHT_N)
    with world_with(friction=3.0) as world:
        push(world, 0.5)
        push(world, 1.0, (share * limit_n / 0.9, 0.0, 0.0))
        x, y, _, _ = world.uav_state()[1]
    assert (math.acos(1 - 2 * (x * x + y * y)) > math.radians(20)) is tips


@pytest.mark.parametrize("tilt_rad", [0.0, 0.2, -0.5])
def test_the_gap_to_the_ground_is_that_of_the_lowest_point(tilt_rad: float) -> None:
    with world_with() as world:
        world.place_uav((0.0, 0.0, 2.0), quaternion_of(pitch_rad=tilt_rad))
        found_m = world.ground_gap_m()
        world.place_uav((0.0, 0.0, 9.0), LEVEL)
        assert world.ground_gap_m() == 3.0
    sine, cosine = abs(math.sin(tilt_rad)), math.cos(tilt_rad)
    gear = HALF_GEAR_M * sine + BODY_ABOVE_FEET_M * cosine
    rotors = HALF_SPAN_M * sine + 0.02 * cosine
    assert found_m == pytest.approx(2.0 - max(gear, rotors), abs=2e-3)


def test_a_ray_measures_to_the_first_body_and_passes_the_hull() -> None:
    ball = solid("sphere", (1.0, 1.0, 1.0), (0.0, 3.0, 1.5), "ball")
    with world_with([WALL, ball]) as world:
        world.place_uav((0.0, 0.0, 2.0), LEVEL)
        assert world.distance_m((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), 9.0) == pytest.approx(2.0)
        assert world.distance_m((0.0, 0.0, 2.0), (1.0, 0.0, 0.0), 9.0) == pytest.approx(2.9)
        assert world.distance_m((0.0, 0.0, 2.0), (0.0, 1.0, 0.0), 9.0) == pytest.approx(2.5)
        assert world.distance_m((0.0, 0.0, 2.0), (1.0, 0.0, 0.0), 2.8) is None
        assert world.distance_m((0.0, 0.0, 2.0), (0.0, 0.0, 1.0), 50.0) is None


@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere"])
def test_distances_to_bodies_are_those_of_their_surfaces(shape: Shape) -> None:
    # Its surface is nearest at x = 1.5, at the height of the rotors.
    thing = solid(shape, (1.0, 1.0, 1.0), (2.0, 0.0, 1.53))
    far = solid("box", (1.0, 1.0, 1.0), (0.0, 30.0, 0.0), "far")
    with world_with([thing, far]) as world:
        world.place_uav((0.0, 0.0, 2.0), LEVEL)
        found = world.separations()
        world.place_uav((-0.4, 0.0, 2.0), LEVEL)
        later_m = world.separations()["thing"]
    assert found["thing"] == pytest.approx(1.5 - HALF_SPAN_M, abs=3e-3)
    assert later_m == pytest.approx(1.9 - HALF_SPAN_M, abs=3e-3)
    # A bound from spheres, which the true distance exceeds.
    assert 3.0 < found["far"] < 29.5 - HALF_SPAN_M


def test_an_ellipsoid_is_the_polyhedron_that_the_camera_draws() -> None:
    crown = solid("ellipsoid", (2.0, 1.0, 3.0), (4.0, 0.0, 0.53))
    with world_with([crown]) as world:
        world.place_uav((1.5, 0.0, 2.0), LEVEL)
        found_m = world.separations()["thing"]
    # Half a side has no vertex at its middle: the two rings beside it end at 0.4755 of the size,
    # on each side of the rotors.
    surface_m = 4.0 - 0.475528258 * 2.0
    assert found_m == pytest.approx(surface_m - 1.5 - HALF_SPAN_M, abs=3e-3)


def test_a_moved_body_is_where_it_was_moved_to() -> None:
    dog = solid("box", (0.8, 0.2, 0.6), (5.0, 5.0, 0.0), "dog")
    with world_with(objects=[dog]) as world:
        world.place_uav((0.0, 0.0, 0.5), LEVEL)
        world.move("dog", (1.5, 0.0, 0.0), math.pi / 2, (-1.0, 0.0, 0.0))
        # It stands across: its side of 0.2 m faces the UAV.
        assert world.separations()["dog"] == pytest.approx(1.5 - 0.1 - HALF_SPAN_M, abs=3e-3)
        world.move("dog", (0.3, 0.0, 0.0), 0.0, (-1.0, 0.0, 0.0))
        assert world.separations()["dog"] <= 0
        push(world, STEP_S, (0.0, 0.0, WEIGHT_N))
        assert [contact.body for contact in world.hull_contacts()] == ["dog"]


def test_a_body_that_flies_into_a_wall_touches_it_where_it_stands() -> None:
    with world_with([WALL]) as world:
        world.place_uav((0.0, 0.0, 2.0), LEVEL)
        touched = world.hull_contacts()
        for _ in range(10 * PHYSICS_RATE_HZ):
            push(world, STEP_S, (0.5 * WEIGHT_N, 0.0, WEIGHT_N))
            touched = world.hull_contacts()
            if touched:
                break
        x, _, _ = world.uav_state()[0]
    assert [contact.body for contact in touched] == ["wall"]
    assert touched[0].position_m == pytest.approx((2.9, 0.0, 2.03), abs=0.06)
    assert x == pytest.approx(2.9 - HALF_SPAN_M, abs=0.03)


def test_equal_steps_give_equal_bytes() -> None:
    def flown() -> list[object]:
        with world_with([WALL]) as world:
            states: list[object] = []
            for tick in range(300):
                side = 3.0 * math.sin(0.05 * tick)
                push(world, STEP_S, (side, 1.0, 1.2 * WEIGHT_N if tick < 100 else 0.0))
                states.append((world.uav_state(), world.separations(), world.ground_gap_m()))
        return states

    assert repr(flown()) == repr(flown())
