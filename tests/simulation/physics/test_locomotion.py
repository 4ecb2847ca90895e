"""Bodies start, stop and turn within the limits of their types; birds do not stop in the air."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed, start_genes
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Move, Situation
from pytest_garl.simulation.physics.npc import Npc

LAWN = load_map("lawn")
EMPTY = dataclasses.replace(LAWN, bodies=())
DT_S = 1 / 60
STEPS = round(DECISION_STEP_S / DT_S)
EAST, WEST, NORTH, STAYS = (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, 0.0)
MoveList = list[tuple[float, float]]


def npc_that(
    moves: MoveList,
    name: str,
    start: tuple[float, float] = (0.0, 0.0),
    map: Map = EMPTY,
    velocity: float = 1.0,
) -> tuple[Npc, Situation]:
    genome = genome_for(map)
    scenario = decode(genome.nominal, genome, map="lawn", seed=1)
    scenario = scenario.replace({**start_genes(name, start, map), f"{name}.velocity": velocity})
    npc = Npc(Placed(scenario, map), name, recorded_spec({name: moves}).make())
    situation = Situation(
        time_s=0.0,
        self=npc.state,
        others=(),
        uav_position_m=(0.0, 0.0, 9.0),
        uav_velocity_mps=(0.0, 0.0, 0.0),
        marker_position_m=(0.0, 0.0),
        map=map,
        scenario=scenario,
    )
    npc.policy.reset(situation, np.random.default_rng(0))
    return npc, situation


def way(
    moves: MoveList,
    name: str,
    start: tuple[float, float] = (0.0, 0.0),
    map: Map = EMPTY,
    velocity: float = 1.0,
) -> NDArray[np.float64]:
    """Return (x, y, vx, vy, yaw) after each 1/60 s of the moves."""
    npc, situation = npc_that(moves, name, start, map, velocity)
    rows = []
    for _ in moves:
        npc.decide(dataclasses.replace(situation, self=npc.state))
        for _ in range(STEPS):
            npc.advance(DT_S)
            rows.append((npc.x_m, npc.y_m, npc.vx_mps, npc.vy_mps, npc.yaw_rad))
    return np.array(rows)


def speeds(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.hypot(rows[:, 2], rows[:, 3]))


def random_moves(seed: int, count: int = 40) -> MoveList:
    rng = np.random.default_rng(seed)
    choices = [EAST, WEST, NORTH, (0.0, -1.0), STAYS, (0.3, -0.4)]
    return [choices[int(rng.integers(len(choices)))] for _ in range(count)]


@pytest.mark.parametrize("name", ["person-1", "dog-1", "bird-1"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_body_keeps_the_limits_of_its_type(name: str, seed: int) -> None:
    rows = way(random_moves(seed), name)
    kind = OBJECT_TYPES[name.partition("-")[0]]
    speed = speeds(rows)
    assert speed.max() <= kind.top_speed_mps + 1e-9
    assert speed.min() >= kind.least_speed_mps - 1e-9
    gained = np.diff(speed) / DT_S
    # At the edge of the map a walker stops at once.
    inside = (np.abs(rows[1:, 0]) < 9.9) & (np.abs(rows[1:, 1]) < 19.9) | bool(kind.flies)
    assert gained[inside].max() <= kind.acceleration_mps2 + 1e-6
    assert gained[inside].min() >= -kind.braking_mps2 - 1e-6
    courses = np.arctan2(rows[:, 3], rows[:, 2])
    turns = np.abs(np.angle(np.exp(1j * np.diff(courses)))) / DT_S
    moving = inside & (speed[:-1] > 0.06) & (speed[1:] > 0.06)
    allowed = np.minimum(kind.turn_rate_radps, kind.lateral_mps2 / np.maximum(speed[:-1], 1e-9))
    assert (turns[moving] <= allowed[moving] + 1e-6).all()
    assert turns[moving].max() > 0.5, "it turned"


def test_person_needs_time_to_start_and_to_stop() -> None:
    speed = speeds(way([EAST] * 4 + [STAYS] * 4, "person-1", (-8.0, 0.0)))
    # 3 m/s at 2.3 m/s² is 1.3 s.
    assert speed[round(0.5 / DT_S)] < 1.3
    assert speed[round(1.4 / DT_S)] == pytest.approx(3.0)
    assert speed[round(2.5 / DT_S)] > 1.5
    assert speed[-1] == 0.0


def test_person_brakes_and_turns_before_it_runs_back() -> None:
    rows = way([EAST] * 5 + [WEST] * 8, "person-1", (-8.0, 0.0))
    back = np.flatnonzero(rows[:, 2] < -0.1)[0] * DT_S
    # At 3 m/s it brakes for 1.3 s, and turns in the meantime.
    assert 3.3 < back < 4.2
    assert rows[-1, 2] < -2.0


def test_standing_person_turns_on_the_spot_before_it_walks() -> None:
    rows = way([WEST] * 4, "person-1")
    away = np.hypot(rows[:, 0], rows[:, 1])
    assert away[round(0.5 / DT_S) - 1] < 0.05, "it faced east: a quarter of a turn takes 0.5 s"
    assert rows[-1, 0] < -0.5


def test_dog_gallops_in_bursts_and_then_runs_what_it_can_keep_up() -> None:
    around = [EAST] * 4 + [NORTH] * 4 + [WEST] * 4 + [(0.0, -1.0)] * 4
    speed = speeds(way(around * 3, "dog-1", (-8.0, -8.0)))
    straight = speeds(way([NORTH] * 8, "dog-1", (0.0, -19.0)))
    assert straight.max() == pytest.approx(8.0)
    assert speed[: round(8 / DT_S)].max() > 6.0
    assert speed[round(16 / DT_S) :].max() < 6.0


def test_slow_dog_never_tires() -> None:
    straight = speeds(way([(0.0, 1.0), (0.0, 1.0)] * 8, "dog-1", (0.0, -19.0), velocity=0.45))
    assert straight[-1] == pytest.approx(0.45 * 8.0)


def test_bird_that_stays_circles_at_its_least_speed() -> None:
    rows = way([STAYS] * 24, "bird-1", (4.0, 4.0))
    kind = OBJECT_TYPES["bird"]
    assert speeds(rows) == pytest.approx(kind.least_speed_mps)
    middle = rows[:, :2][: round(2 * math.pi * 7 / 8.2 / DT_S)].mean(axis=0)
    radius = np.hypot(*(rows[:, :2] - middle).T)
    assert radius == pytest.approx(kind.turn_radius_m, abs=0.3)


def test_bird_without_speed_sits_on_the_ground_where_it_starts() -> None:
    npc, situation = npc_that([NORTH] * 2, "bird-1", (4.0, 4.0), velocity=0.0)
    npc.decide(situation)
    npc.advance(0.5)
    assert npc.position_m == pytest.approx((4.0, 4.0, 0.1))
    assert npc.low_m == pytest.approx(0.0)
    assert npc.state.top_m == pytest.approx(0.2)


def test_bird_flies_at_the_height_that_the_scenario_gives() -> None:
    npc, situation = npc_that([NORTH], "bird-1")
    assert npc.position_m[2] == 3.0
    genes = (*situation.scenario.genes, ("bird-1.height_m", 6.5))
    scenario = dataclasses.replace(situation.scenario, genes=genes)
    assert Placed(scenario, EMPTY).npc("bird-1").height_m == 6.5
    higher = Npc(Placed(scenario, EMPTY), "bird-1", npc.policy)
    assert (higher.low_m, higher.high_m) == pytest.approx((6.4, 6.6))
    assert (higher.state.bottom_m, higher.state.top_m) == pytest.approx((6.4, 6.6))


def test_bird_that_flies_away_turns_back_beyond_the_map() -> None:
    rows = way([EAST] * 40, "bird-1")
    assert rows[:, 0].max() > EMPTY.bounds_m[1] + 15
    assert rows[:, 0].max() < EMPTY.bounds_m[1] + 45
    assert rows[-1, 0] < rows[:, 0].max() or rows[-1, 2] < 0


@pytest.mark.parametrize("seed", range(6))
def test_bird_flies_around_trees_without_stopping(seed: int) -> None:
    low = dataclasses.replace(LAWN, objects=(("bird", 1),))
    rows = way(random_moves(seed, 60), "bird-1", (1.0, -12.0), map=low, velocity=0.5)
    npc, _ = npc_that([STAYS], "bird-1", (1.0, -12.0), map=low)
    assert speeds(rows).min() > 6.9
    assert npc._solids, "trees stand at its height"
    gaps = [
        (np.hypot(rows[:, 0] - disc.x_m, rows[:, 1] - disc.y_m) - disc.radius_m).min()
        for disc in npc._solids
    ]
    assert min(gaps) > npc.type.radius_m - 0.05


def test_fixed_moves_are_recorded_as_they_were_decided() -> None:
    npc, situation = npc_that([EAST, NORTH], "bird-1")
    assert npc.decide(situation) == Move(x=1.0, y=0.0)
    assert npc.moves == [EAST]
