from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from landing_systems.modules.planning_ego import LANDING, EgoParameters
from landing_systems.modules.planning_ego.grid import OccupancyGrid
from pytest_garl import Camera
from tests.landing_systems.box_world import LEVEL, Box, depth_image

CAMERA = Camera(width_px=160, height_px=120)
SMALL = EgoParameters(
    resolution_m=0.25, map_size_m=(20.0, 20.0, 8.0), ceiling_m=8.0, ground_height_m=0.25,
    inflation_m=0.25, max_ray_m=12.0, update_range_m=(10.0, 10.0, 10.0),
)  # fmt: skip
TOWER: Box = ((1.0, -0.5, 0.0), (2.0, 0.5, 1.9))


def look(
    grid: OccupancyGrid,
    time_s: float,
    boxes: list[Box],
    eye: tuple[float, float, float] = (0.0, 0.0, 5.0),
    attitude: np.ndarray = LEVEL,
) -> None:
    depth = depth_image(CAMERA, eye, attitude, boxes)
    grid.observe(time_s, np.array(eye), attitude, depth)


def probability_after(hits: int, misses: int) -> float:
    grid = OccupancyGrid(SMALL, CAMERA)
    for frame in range(hits):
        look(grid, frame / 10, [TOWER])
    for frame in range(misses):
        look(grid, 10 + frame / 10, [])
    return grid.probability((1.5, 0.1, 1.85))


def test_a_hit_multiplies_the_odds_by_those_of_the_sensor_model() -> None:
    # 0.12 / 0.88 * 0.65 / 0.35 = 0.25325, which is a probability of 0.2021.
    assert probability_after(1, 0) == pytest.approx(0.2021, abs=1e-4)
    # And twice: 0.47032, which is 0.3199.
    assert probability_after(2, 0) == pytest.approx(0.3199, abs=1e-4)


def test_a_miss_divides_the_odds_down_to_the_lower_clamp() -> None:
    # Two hits and a miss are a hit.
    assert probability_after(2, 1) == pytest.approx(0.2021, abs=1e-4)
    assert probability_after(2, 9) == pytest.approx(0.12)


def test_six_hits_occupy_and_two_misses_clear_with_upstreams_sensor_model() -> None:
    grid = OccupancyGrid(SMALL, CAMERA)
    top = np.array([[1.5, 0.1, 1.85]])
    for frame in range(20):
        assert grid.occupied(top)[0] == (frame >= 6)
        look(grid, frame / 10, [TOWER])
    assert grid.probability((1.5, 0.1, 1.85)) == pytest.approx(0.90)
    look(grid, 3.0, [])
    assert grid.occupied(top)[0]
    look(grid, 3.1, [])
    assert not grid.occupied(top)[0]


def test_one_hit_occupies_for_the_landing_system() -> None:
    grid = OccupancyGrid(LANDING, CAMERA)
    dog: Box = ((-0.3, -0.15, 0.3), (0.3, 0.15, 0.6))
    depth = depth_image(CAMERA, (0.0, 0.0, 9.95), LEVEL, [dog])
    grid.observe(0.0, np.array([0.0, 0.0, 10.0]), LEVEL, depth)
    assert grid.occupied(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.2]])).all()
    assert not grid.occupied(np.array([[0.0, 0.0, 2.0], [3.0, 0.0, 1.0]])).any()


@pytest.mark.parametrize("tilt", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.1, -0.15, 0.8)])
def test_a_box_is_where_it_is_whatever_the_attitude(tilt: tuple[float, float, float]) -> None:
    grid = OccupancyGrid(SMALL, CAMERA)
    attitude = Rotation.from_euler("xyz", tilt).as_quat()
    for frame in range(8):
        look(grid, frame / 10, [TOWER], attitude=attitude)
    cells = grid.obstacles_m()
    low, high = (np.array(corner) for corner in TOWER)
    outside = np.maximum(np.maximum(low - cells, cells - high), 0)
    # A cell that a ray ends in has its centre half a diagonal off the surface at most.
    assert np.linalg.norm(outside, axis=1).max() < 0.25 * math.sqrt(3) / 2
    tops = {tuple(cell[:2]) for cell in cells if cell[2] > 1.7}
    assert len(tops) >= 16


def test_the_ground_is_no_obstacle_from_any_attitude() -> None:
    grid = OccupancyGrid(LANDING, CAMERA)
    for frame, angle in enumerate(np.linspace(-0.4, 0.4, 4)):
        attitude = Rotation.from_euler("xyz", (angle, angle / 2, frame)).as_quat()
        for height in (0.3, 2.0, 9.0):
            look(grid, frame / 10, [], (0.0, 0.0, height), attitude)
    assert not len(grid.obstacles_m())


def test_obstacles_grow_by_the_inflation_rounded_up_to_cells() -> None:
    parameters = EgoParameters(resolution_m=0.2, inflation_m=0.3, vertical_inflation_m=0.2)
    grid = OccupancyGrid(parameters, CAMERA)
    centre = np.array([[1.1, 1.1, 1.09]])
    grid.add_solid(0.0, centre)
    steps = np.array([[-3, 0, 0], [-2, 0, 0], [2, 2, 1], [0, 3, 0], [0, 0, 1], [0, 0, 2]])
    found = grid.occupied(centre + 0.2 * steps)
    assert found.tolist() == [False, True, True, False, True, False]


def test_inflation_of_two_neighbours_stays_when_one_is_cleared() -> None:
    grid = OccupancyGrid(SMALL, CAMERA)
    pole: Box = ((-1.1, 0.0, 0.0), (-0.9, 0.2, 1.9))
    for frame in range(10):
        look(grid, frame / 10, [TOWER, pole])
    everything = grid.occupancy.copy()
    for frame in range(10):
        look(grid, 2 + frame / 10, [TOWER])
    only = OccupancyGrid(SMALL, CAMERA)
    only.add_solid(0.0, grid.obstacles_m())
    assert (grid.occupancy == only.occupancy).all()
    assert (everything != grid.occupancy).any()


def test_cells_that_a_moving_thing_has_left_are_cleared_when_looked_at() -> None:
    grid = OccupancyGrid(LANDING, CAMERA)
    for frame in range(20):
        x = -3 + frame * 0.3
        look(grid, frame / 10, [((x, 0.0, 0.0), (x + 0.6, 0.6, 1.7))])
    cells = grid.obstacles_m()
    assert len(cells)
    assert cells[:, 0].min() > 2.7 - 0.6


def ghost_after(seconds: float, stood_s: float, forget_after_s: float | None) -> bool:
    parameters = EgoParameters(
        forget_after_s=forget_after_s, static_after_s=1.0, p_hit=0.97, ground_height_m=0.25
    )
    grid = OccupancyGrid(parameters, CAMERA)
    for time_s in np.arange(0.0, stood_s + 0.05, 0.1):
        look(grid, time_s, [TOWER], (0.0, 0.0, 4.0))
    look(grid, stood_s + seconds, [], (-15.0, 0.0, 4.0))
    return len(grid.obstacles_m()) > 0


def test_unseen_cells_stay_occupied_as_upstream_unless_told_to_forget() -> None:
    assert ghost_after(60.0, 0.3, None)
    assert ghost_after(2.0, 0.3, 3.0)
    assert not ghost_after(4.0, 0.3, 3.0)


def test_a_still_obstacle_is_not_forgotten() -> None:
    assert ghost_after(60.0, 1.5, 3.0)


def test_cells_below_an_obstacle_are_occupied_if_so_set() -> None:
    column = np.array([[0.1, 0.1, z] for z in (0.3, 1.5, 3.0, 3.4, 4.5)])
    for fill, expected in (
        (False, [False, False, True, True, False]),
        (True, [True] * 4 + [False]),
    ):
        grid = OccupancyGrid(
            EgoParameters(fill_below=fill, resolution_m=0.2, inflation_m=0.4, ceiling_m=6.0,
                          map_size_m=(8.0, 8.0, 6.0)),
            CAMERA,
        )  # fmt: skip
        grid.add_solid(0.0, np.array([[0.1, 0.1, 3.1]]))
        assert grid.occupied(column).tolist() == expected


def test_columns_are_freed_when_their_top_goes() -> None:
    grid = OccupancyGrid(LANDING, CAMERA)
    empty = grid.occupancy.copy()
    look(grid, 0.0, [TOWER], (1.0, 0.0, 6.0))
    assert (grid.occupancy != empty).any()
    for frame in range(1, 4):
        look(grid, frame / 10, [], (1.0, 0.0, 6.0))
    assert (grid.occupancy == empty).all()


def test_outside_is_occupied_but_the_ground_is_not() -> None:
    grid = OccupancyGrid(SMALL, CAMERA, (5.0, 0.0))
    places = np.array([[14.9, 0.0, 1.0], [15.1, 0.0, 1.0], [-5.1, 0.0, 1.0], [5.0, 0.0, 8.3]])
    assert grid.occupied(places).tolist() == [False, True, True, True]
    assert not grid.occupied(np.array([[5.0, 0.0, 0.0], [5.0, 0.0, -3.0]])).any()
    grid.add_solid(0.0, np.array([[5.0, 0.0, 0.3]]))
    assert grid.occupied(np.array([[5.0, 0.0, 0.0]])).all()


def test_depth_that_is_no_number_or_too_near_changes_nothing() -> None:
    grid = OccupancyGrid(LANDING, CAMERA)
    look(grid, 0.0, [TOWER])
    cells = grid.obstacles_m()
    for nothing in (np.nan, 0.0, 0.1):
        depth = np.full((120, 160), nothing, np.float32)
        grid.observe(1.0, np.array([0.0, 0.0, 5.0]), LEVEL, depth)
    assert (grid.obstacles_m() == cells).all()


def test_a_depth_image_of_another_size_is_refused() -> None:
    grid = OccupancyGrid(LANDING, CAMERA)
    with pytest.raises(ValueError, match=r"\(4, 4\).*expected \(120, 160\)"):
        grid.observe(0.0, np.zeros(3), LEVEL, np.ones((4, 4), np.float32))


def test_nearest_free_place_is_beside_the_inflated_obstacle() -> None:
    grid = OccupancyGrid(SMALL, CAMERA)
    grid.add_solid(0.0, np.array([[0.1, 0.1, 3.1]]))
    place = np.array([0.3, 0.12, 3.12])
    found = grid.nearest_free(place, 1.0, 0.0)
    assert found is not None
    assert found.tolist() == pytest.approx([0.625, 0.125, 3.125])
    assert grid.nearest_free(place, 1.0, 5.0) is None
