"""Several objects: copies of one policy compared with objects trained together.

``python -m studies.team --train`` trains two objects together.  They share weights, start with
those of the shipped policy, see the nearest other object and are
rewarded for a collision of either.
``python -m studies.team`` flies both policies with one, two and three objects, and appends the
chunks of fifty flights that ``docs/team.csv`` lacks; ``--report`` prints the table.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import itertools
import math
import os
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import Progress

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.adversary.learned import Network, save
from pytest_garl.adversary.observations import (
    LIMIT,
    PLACE_SCALE_M,
    Encoding,
    State,
    in_own_frame,
    relative,
    relative_moves,
)
from pytest_garl.adversary.training import rewards
from pytest_garl.adversary.training.dqn import Experience, Learner
from pytest_garl.adversary.training.episode import Episode, draw_episode
from pytest_garl.adversary.training.presets import Training
from pytest_garl.adversary.training.uav_models import (
    AvoidanceParameters,
    AvoidingPilot,
    FlightStyle,
)
from pytest_garl.adversary.weights import WEIGHTS
from pytest_garl.scenarios.genes import WEATHER, genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.npc_policy import Move, PolicySpec, Situation
from studies.adversary import CHUNK, MAPS, SYSTEMS
from studies.table import Key, ResultTable, Row, run_study, share

JOINT_WEIGHTS = Path(".garl/team/together.npz")
TYPES = ("person", "dog", "bird")
SEED = 5151
COUNTS = (1, 2, 3)
TABLE = ResultTable(
    file=Path("docs/team.csv"),
    columns=("mover", "objects", "system", "map", "chunk", "flights", "collided", "blocked"),
    key=("mover", "objects", "system", "map", "chunk"),
)


def state_with_nearest_object(situation: Situation) -> State:
    """Return the relative state and the offset of the nearest other object, (12,).

    The offset is in the object's own frame; without another object it is 20 m behind.
    """
    x, y, _ = situation.self.position_m
    near = min(
        (other.position_m for other in situation.others),
        key=lambda place: math.dist(place[:2], (x, y)),
        default=None,
    )
    ahead, aside = in_own_frame(situation, near[0] - x, near[1] - y) if near else (-20.0, 0.0)
    offset = np.array([ahead / PLACE_SCALE_M, aside / PLACE_SCALE_M], dtype=np.float32)
    return np.concatenate([relative(situation), np.clip(offset, -LIMIT, LIMIT)])


ENCODING = Encoding(size=12, state=state_with_nearest_object, moves=relative_moves)


class JointlyTrainedPolicy:
    """The policy of objects that were trained together."""

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Load the weights."""
        self._network = _network()

    def decide(self, situation: Situation) -> Move:
        """Return the best action."""
        values = self._network.values(ENCODING.state(situation))
        return ENCODING.moves(situation)[int(np.argmax(values))]


@functools.cache
def _network() -> Network:
    with np.load(JOINT_WEIGHTS) as arrays:
        layers = [
            (
                arrays[f"weight_{index}"].astype(np.float64),
                arrays[f"bias_{index}"].astype(np.float64),
            )
            for index in range(len(arrays) // 2)
        ]
    return Network(state="fellow", layers=tuple(layers))


def warm_learner(training: Training) -> Learner:
    """Return a learner that begins as the shipped policy and ignores other objects."""
    learner = Learner(ENCODING.size, 5, training)
    with np.load(WEIGHTS / "dqn.npz") as arrays, torch.no_grad():
        linear = [layer for layer in learner.network if isinstance(layer, torch.nn.Linear)]
        for index, layer in enumerate(linear):
            weight = arrays[f"weight_{index}"]
            layer.weight.zero_()
            layer.weight[:, : weight.shape[1]] = torch.from_numpy(weight)
            layer.bias.copy_(torch.from_numpy(arrays[f"bias_{index}"]))
    learner.target.load_state_dict(learner.network.state_dict())
    return learner


def train_together(training: Training, count: int) -> Learner:
    """Train objects that share weights, one episode after the other."""
    torch.set_num_threads(1)
    learner = warm_learner(training)
    maps = [load_map(name) for name in MAPS]
    with Progress() as bar:
        task = bar.add_task("together", total=training.episodes)
        for number in range(training.episodes):
            rng = np.random.default_rng([training.seed, number])
            types = [TYPES[int(index)] for index in rng.integers(3, size=count)]
            scenario, place = draw_episode(maps[int(rng.integers(2))], types, rng)
            pilot = functools.partial(
                AvoidingPilot, FlightStyle.drawn(rng), AvoidanceParameters.drawn(rng)
            )
            episode = Episode(scenario, place, pilot)
            experiences = [Experience(learner) for _ in types]
            epsilon = max(training.epsilon_least, training.epsilon * training.epsilon_decay**number)
            while episode.outcome is None:
                _decide(episode, learner, experiences, epsilon)
            episode.close()
            bar.update(task, completed=number + 1)
    return learner


def _decide(
    episode: Episode, learner: Learner, experiences: list[Experience], epsilon: float
) -> None:
    before = episode.situations
    states = np.stack([ENCODING.state(situation) for situation in before])
    actions = learner.act(states, epsilon)
    episode.step(
        [ENCODING.moves(seen)[int(action)] for seen, action in zip(before, actions, strict=True)]
    )
    after = episode.situations
    collided, cut = episode.hit is not None, episode.outcome == "not_landed"
    ended = episode.outcome is not None and not cut
    for index, experience in enumerate(experiences):
        distances = [
            rewards.column_distance_m(each[index].self.position_m, each[index].uav_position_m)
            for each in (before, after)
        ]
        reward = rewards.collision_first(
            *distances, collided=collided, ended=ended, discount=learner.training.discount
        )
        experience.add(
            states[index],
            int(actions[index]),
            reward,
            ENCODING.state(after[index]),
            terminated=ended,
            truncated=cut,
        )
        learner.update()


def scenarios(name: str, count: int, chunk: int) -> list[tuple[Scenario, Map]]:
    """Return random scenarios with ``count`` objects of random types, in clear weather."""
    rng = np.random.default_rng([SEED, count, chunk])
    clear = {f"environment.{each}": 0.0 for each, _ in WEATHER}
    found = []
    for index in range(CHUNK):
        types = [TYPES[int(index)] for index in rng.integers(3, size=count)]
        counts = tuple((type_name, types.count(type_name)) for type_name in dict.fromkeys(types))
        map = dataclasses.replace(load_map(name), objects=counts)
        scenario = random_scenarios(map, genome_for(map), SEED + chunk, index, 1)[0]
        found.append((scenario.replace(clear), map))
    return found


def fly_one(job: tuple[Scenario, Map, str, str]) -> tuple[bool, bool]:
    """Return whether the UAV hit an object, and whether it gave up or ran out of time."""
    import cv2

    from landing_systems.opencv_mls import OpenCvLandingSystem
    from pytest_garl.simulation.fly import fly
    from studies.avoiding import AvoidingLandingSystem

    cv2.setNumThreads(1)
    scenario, map, mover, system = job
    made: Any = {"opencv": OpenCvLandingSystem, "avoiding": AvoidingLandingSystem}[system]
    spec = PolicySpec(name="together", factory="studies.team:JointlyTrainedPolicy")
    if mover == "copies":
        spec = policy_spec("dqn")
    flight = fly(scenario, made, spec, map=map)
    hit = flight.outcome == "collision" and flight.contacts[-1].body_class == "dynamic"
    return hit, flight.outcome in ("gave_up", "not_landed")


def report(rows: list[Row]) -> str:
    """Return a Markdown table over both maps."""
    lines = [
        "| system | objects | mover | flights | collided | no landing |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for system in SYSTEMS:
        for count in COUNTS:
            for mover in ("copies", "together"):
                key = (system, str(count), mover)
                own = [r for r in rows if (r["system"], r["objects"], r["mover"]) == key]
                if not own:
                    continue
                flights = sum(int(row["flights"]) for row in own)
                cells = [
                    share(sum(int(row[name]) for row in own), flights)
                    for name in ("collided", "blocked")
                ]
                lines.append(f"| {system} | {count} | {mover} | {flights} | {' | '.join(cells)} |")
    return "\n".join(lines)


def row_of(key: Key, pool: Executor) -> dict[str, Any]:
    """Fly one chunk; return its row."""
    mover, count, system, map, chunk = key
    jobs = [
        (each, map_with_objects, mover, system)
        for each, map_with_objects in scenarios(map, int(count), int(chunk))
    ]
    results = list(pool.map(fly_one, jobs))
    figures = (len(results), sum(hit for hit, _ in results), sum(blocked for _, blocked in results))
    return dict(zip(TABLE.columns, (*key, *figures), strict=True))


def main() -> None:
    """Train, fly or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--train", action="store_true")
    parser.add_argument("--episodes", type=int, default=800)
    parser.add_argument("--flights", type=int, default=300, help="per cell, both maps together")
    run_study(parser, TABLE, report, train_or_fly)


def train_or_fly(arguments: argparse.Namespace) -> None:
    """Train two objects together, or fly the chunks that the table lacks."""
    if arguments.train:
        training = Training(episodes=arguments.episodes, epsilon=0.3)
        save(JOINT_WEIGHTS, train_together(training, 2).policy("fellow"), {"policy": "together"})
        return
    chunks = range(-(-arguments.flights // CHUNK // len(MAPS)))
    keys = (
        (mover, str(count), system, map, str(chunk))
        for chunk, system, map, count, mover in itertools.product(
            chunks, SYSTEMS, MAPS, COUNTS, ("copies", "together")
        )
    )
    TABLE.fly_missing(keys, row_of, os.cpu_count())


if __name__ == "__main__":
    main()
