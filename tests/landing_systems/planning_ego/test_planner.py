from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from landing_systems.modules.planning_ego import (
    LANDING,
    EgoParameters,
    EgoPlanner,
    GoalInObstacleError,
    NoTrajectoryError,
    costs,
)
from landing_systems.modules.planning_ego.astar import find_guide
from landing_systems.modules.planning_ego.bspline import UniformSpline
from landing_systems.modules.planning_ego.grid import OccupancyGrid
from landing_systems.modules.planning_ego.trajectory import plan_trajectory
from pytest_garl import Camera
from tests.landing_systems.box_world import Box, Run, distance_to, fly

CAMERA = Camera(width_px=80, height_px=60)
PARAMETERS = dataclasses.replace(LANDING, map_size_m=(30.0, 20.0, 10.0), ceiling_m=10.0)
UAV_RADIUS_M = 0.5


def known(*boxes: Box) -> OccupancyGrid:
    """Return a grid that knows boxes from a map."""
    grid = OccupancyGrid(PARAMETERS, CAMERA)
    for low, high in boxes:
        axes = [np.arange(a + 0.125, b, 0.25) for a, b in zip(low, high, strict=True)]
        grid.add_solid(0.0, np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3))
    return grid


def at(
    place: tuple[float, float, float], velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> np.ndarray:
    return np.array([place, velocity, (0.0, 0.0, 0.0)])


def plan(
    grid: OccupancyGrid,
    start: tuple[float, float, float] = (-5.0, 0.0, 3.0),
    end: tuple[float, float, float] = (2.5, 0.0, 3.0),
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> UniformSpline:
    return plan_trajectory(grid, PARAMETERS, start=at(start, velocity), end=at(end), at_goal=True)


def assert_safe_and_slow_enough(spline: UniformSpline, boxes: Sequence[Box]) -> None:
    times = np.linspace(0, spline.duration_s, 300)
    assert distance_to(boxes, spline.evaluate(times)).min() > UAV_RADIUS_M
    speeds = np.linalg.norm(spline.evaluate(times, 1), axis=1)
    assert speeds.max() <= 1.05 * PARAMETERS.max_vel_mps
    assert np.abs(spline.evaluate(times, 1)[:, 2]).max() <= 1.05 * PARAMETERS.vertical_vel_mps
    accelerations = np.linalg.norm(spline.evaluate(times, 2), axis=1)
    assert accelerations.max() <= 1.05 * PARAMETERS.max_acc_mps2


POST: Box = ((-2.0, -0.5, 0.25), (-1.0, 0.5, 6.0))
WALLS: tuple[Box, Box] = (
    ((-1.5, -9.0, 0.25), (-1.0, 0.5, 9.5)),
    ((-1.5, 4.0, 0.25), (-1.0, 9.0, 9.5)),
)


def test_a_guide_leads_around_and_ends_where_asked() -> None:
    grid = known(POST)
    start, goal = np.array([-5.0, 0.0, 3.0]), np.array([2.5, 0.0, 3.0])
    for step in (1, 2):
        guide = find_guide(grid, start, goal, lowest_m=1.0, step=step, weight=1.2, max_nodes=50_000)
        assert guide is not None
        assert not grid.occupied(guide).any()
        assert np.abs(guide[[0, -1]] - [start, goal]).max() <= 0.125 + 1e-9
        assert np.abs(np.diff(guide, axis=0)).max() <= 0.25 * step + 1e-9
        assert guide[:, 2].min() > 1.0


def test_a_guide_through_free_space_is_straight() -> None:
    guide = find_guide(
        known(), np.array([0.1, 0.1, 3.1]), np.array([2.1, 0.1, 3.1]),
        lowest_m=1.0, step=1, weight=1.0001, max_nodes=1000,
    )  # fmt: skip
    assert guide is not None
    assert len(guide) == 9


def test_there_is_no_guide_into_an_obstacle_or_after_too_many_nodes() -> None:
    grid = known(POST)
    start, beyond = np.array([-5.0, 0.0, 3.0]), np.array([2.5, 0.0, 3.0])
    inside = np.array([-1.5, 0.0, 3.0])

    def search(goal: np.ndarray, max_nodes: int) -> np.ndarray | None:
        return find_guide(grid, start, goal, lowest_m=1.0, step=1, weight=1.2, max_nodes=max_nodes)

    assert search(inside, 10_000) is None
    assert search(beyond, 10) is None
    assert search(beyond, 10_000) is not None


@pytest.mark.parametrize("velocity", [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
def test_a_trajectory_passes_a_post_within_the_limits(
    velocity: tuple[float, float, float],
) -> None:
    spline = plan(known(POST), velocity=velocity)
    assert_safe_and_slow_enough(spline, [POST])
    assert np.allclose(spline.evaluate(0.0, 1), velocity)
    assert np.allclose(spline.evaluate(spline.duration_s), (2.5, 0.0, 3.0))


def test_a_trajectory_finds_the_gap_in_a_wall() -> None:
    spline = plan(known(*WALLS))
    assert_safe_and_slow_enough(spline, WALLS)
    crossing = spline.evaluate(np.linspace(0, spline.duration_s, 300))
    inside = crossing[(crossing[:, 0] > -1.5) & (crossing[:, 0] < -1.0)]
    assert ((inside[:, 1] > 1.0) & (inside[:, 1] < 3.5)).all()


def test_time_is_added_until_the_limits_hold() -> None:
    # Straight up: the vertical limit is half of the speed for which knots are spaced.
    spline = plan(known(), start=(0.0, 0.0, 1.5), end=(1.0, 0.0, 8.5))
    assert_safe_and_slow_enough(spline, [POST])
    assert max(costs.usage(spline.points, spline.span_s, PARAMETERS)) <= 1.05
    assert spline.duration_s > 7.0 / PARAMETERS.vertical_vel_mps


def test_a_start_within_the_inflation_may_leave_it() -> None:
    start = (-2.6, 0.0, 3.0)
    grid = known(POST)
    assert grid.occupied(np.array([start])).all()
    spline = plan(grid, start=start, end=(-7.0, 0.0, 3.0))
    places = spline.evaluate(np.linspace(0, spline.duration_s, 200))
    assert distance_to([POST], places).min() > UAV_RADIUS_M


def test_a_goal_in_an_obstacle_has_an_error_of_its_own() -> None:
    with pytest.raises(GoalInObstacleError, match=r"the goal at \(-1.50, 0.00, 3.00\) m"):
        plan(known(POST), end=(-1.5, 0.0, 3.0))


def test_no_way_is_an_error_of_its_own() -> None:
    closed: Box = ((-1.5, -10.0, 0.25), (-1.0, 10.0, 10.0))
    with pytest.raises(NoTrajectoryError, match=r"none of 3 initial paths"):
        plan(known(closed))


def run(goal: tuple[float, float, float], boxes: Sequence[Box] = (), **settings: Any) -> Run:
    parameters = dataclasses.replace(PARAMETERS, **settings)
    planner = EgoPlanner(parameters, CAMERA)
    return fly(planner, parameters, CAMERA, (-10.0, 0.0, 7.0), goal, lambda _: boxes)


def states(found: Run) -> list[str]:
    """Return the states in their order, each once per visit."""
    names = [setpoint.state for setpoint in found.setpoints]
    return [b for a, b in zip(["", *names], names, strict=False) if a != b]


def test_it_flies_to_the_goal_and_waits_for_the_next() -> None:
    found = run((8.0, 1.0, 5.0))
    assert found.setpoints[-1].reached
    assert states(found) == ["EXEC_TRAJ", "WAIT_TARGET"]
    assert np.linalg.norm(found.position_m[-1] - (8.0, 1.0, 5.0)) < 0.05
    assert found.time_s[-1] < 18.0 / 2.5 + 4.0
    # The path for the diagnostics begins at the UAV.
    middle = found.setpoints[30]
    assert np.linalg.norm(np.array(middle.path_m[0]) - found.position_m[30]) < 0.4
    assert middle.error is None


def test_it_descends_beside_an_obstacle_seen_from_above() -> None:
    boxes: list[Box] = [((-1.0, -1.0, 0.0), (0.5, 1.0, 4.0))]
    planner = EgoPlanner(PARAMETERS, CAMERA)
    above, low = (3.0, 0.0, 7.0), (-3.5, 0.0, 2.0)
    fly(planner, PARAMETERS, CAMERA, (-5.0, 0.0, 7.0), above, lambda _: boxes)
    down = fly(planner, PARAMETERS, CAMERA, above, low, lambda _: boxes, from_s=20.0)
    assert down.setpoints[-1].reached
    assert distance_to(boxes, down.position_m).min() > UAV_RADIUS_M


def test_a_goal_in_an_obstacle_is_reported_and_avoided() -> None:
    boxes: list[Box] = [((5.0, -1.0, 0.0), (7.0, 1.0, 3.0))]
    planner = EgoPlanner(PARAMETERS, CAMERA)
    above, within = (6.0, 0.0, 7.0), (6.0, 0.0, 2.0)
    fly(planner, PARAMETERS, CAMERA, (3.0, 0.0, 7.0), above, lambda _: boxes)
    found = fly(planner, PARAMETERS, CAMERA, above, within, lambda _: boxes, seconds=4, from_s=20.0)
    assert not found.setpoints[-1].reached
    assert isinstance(found.setpoints[-1].error, GoalInObstacleError)
    assert distance_to(boxes, found.position_m).min() > UAV_RADIUS_M


def test_it_stops_when_something_pops_up_too_near_to_avoid() -> None:
    ahead: Box = ((1.5, -9.9, 0.0), (2.5, 9.9, 9.9))
    planner = EgoPlanner(PARAMETERS, CAMERA)
    moving = np.array([2.0, 0.0, 0.0])
    planner.set_goal((8.0, 0.0, 5.0))
    place = np.array([-2.0, 0.0, 5.0])
    first = planner.plan(0.0, place, moving)
    assert first.state == "EXEC_TRAJ"
    later = planner.plan(0.5, np.array(first.position_m) + 0.4 * moving, moving)
    assert later.state == "EXEC_TRAJ"
    axes = [np.arange(a + 0.125, b, 0.25) for a, b in zip(*ahead, strict=True)]
    planner.grid.add_solid(0.6, np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3))
    here = np.array([-0.2, 0.0, 5.0])
    stop = planner.plan(0.9, here, moving)
    assert stop.state == "EMERGENCY_STOP"
    assert isinstance(stop.error, NoTrajectoryError)
    assert stop.position_m == pytest.approx(here)
    assert stop.velocity_mps == (0.0, 0.0, 0.0)
    # It stays until the UAV stands, then tries again, and again.
    assert planner.plan(1.0, here, moving).state == "EMERGENCY_STOP"
    assert planner.plan(1.5, here, np.zeros(3)).state == "GEN_NEW_TRAJ"
    assert planner.plan(1.6, here, np.zeros(3)).error is not None


def test_without_a_goal_it_waits_where_it_is() -> None:
    planner = EgoPlanner(PARAMETERS, CAMERA)
    setpoint = planner.plan(0.0, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0))
    assert (setpoint.state, setpoint.position_m) == ("WAIT_TARGET", (1.0, 2.0, 3.0))
    assert setpoint.path_m == ()


def test_a_uav_far_off_its_trajectory_plans_from_where_it_is() -> None:
    planner = EgoPlanner(PARAMETERS, CAMERA)
    planner.set_goal((8.0, 0.0, 5.0))
    planner.plan(0.0, (-8.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    blown = np.array([-8.0, 3.0, 5.0])
    setpoint = planner.plan(0.1, blown, np.zeros(3))
    assert setpoint.state == "EXEC_TRAJ"
    assert np.linalg.norm(np.array(setpoint.path_m[0]) - blown) < 0.01


def test_equal_runs_give_equal_bytes() -> None:
    boxes: list[Box] = [((1.5, -1.0, 0.0), (3.0, 1.0, 5.0)), ((4.0, 0.5, 0.0), (4.5, 2.0, 3.0))]
    first, second = (run((6.0, 0.0, 2.0), boxes) for _ in range(2))
    assert first.position_m.tobytes() == second.position_m.tobytes()
    assert first.setpoints[-1] == second.setpoints[-1]


def test_goals_and_parameters_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match="three finite numbers"):
        EgoPlanner(PARAMETERS, CAMERA).set_goal((0.0, float("nan"), 1.0))
    with pytest.raises(ValueError, match=r"max_vel_mps is -1.*more than 0"):
        EgoParameters(max_vel_mps=-1)
    with pytest.raises(ValueError, match="p_min, p_occupied, p_max"):
        EgoParameters(p_occupied=0.95)
    with pytest.raises(ValueError, match="p_miss"):
        EgoParameters(p_miss=0.6)
