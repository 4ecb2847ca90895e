"""Unlearned policies: objects that stand, wander, walk to destinations or over the marker."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for, with_destinations
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placement import object_destination_m
from pytest_garl.simulation.npc_policy import (
    DECISION_STEP_S,
    STAY,
    Move,
    ObjectState,
    PolicySpec,
    Situation,
    decision,
)

ARRIVED_M = 0.5


class Stationary:
    """Stays where it starts."""

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def decide(self, situation: Situation) -> Move:
        """Stay."""
        return STAY


class Waypoint:
    """Walks to a destination drawn within the map's bounds, then to the next.

    The paper's random baseline: "dynamic objects' start positions and destinations are
    generated randomly within the specified map range".
    """

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Draw the first destination."""
        self._rng = rng
        self._draw(situation)

    def decide(self, situation: Situation) -> Move:
        """Go straight towards the destination."""
        if _arrived(self._goal, situation):
            self._draw(situation)
        return _towards(self._goal, situation)

    def _draw(self, situation: Situation) -> None:
        x_min, x_max, y_min, y_max = situation.map.bounds_m
        self._goal = (
            float(self._rng.uniform(x_min, x_max)),
            float(self._rng.uniform(y_min, y_max)),
        )


class RandomWalk:
    """Takes one of the paper's five actions at random at every decision."""

    _MOVES = ((0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0))

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Keep the generator."""
        self._rng = rng

    def decide(self, situation: Situation) -> Move:
        """Draw an action."""
        x, y = self._MOVES[int(self._rng.integers(len(self._MOVES)))]
        return Move(x=x, y=y)


class Greedy:
    """Walks across the marker, turns, and walks across it again; it never stops.

    A rival of learned policies: most of what they do can be had this way.
    """

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Start towards the marker."""
        self._move = _towards(situation.marker_position_m, situation)

    def decide(self, situation: Situation) -> Move:
        """Go straight to the marker, and on beyond it by one decision."""
        stride = situation.self.speed_mps * DECISION_STEP_S
        if math.dist(situation.self.position_m[:2], situation.marker_position_m) > stride:
            self._move = _towards(situation.marker_position_m, situation)
        return self._move


class Stand:
    """Walks to the marker and stands on it."""

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def decide(self, situation: Situation) -> Move:
        """Go to the marker, slower over the last step, and stay."""
        goal = situation.marker_position_m
        stride = situation.self.speed_mps * DECISION_STEP_S
        distance = math.dist(situation.self.position_m[:2], goal)
        move = _towards(goal, situation)
        share = min(1.0, distance / stride) if stride > 0 else 0.0
        return Move(x=share * move.x, y=share * move.y)


class Destination:
    """Walks from its start to the place that its genes say, back, and there again.

    For the paper's baselines whose objects have a start and an end, ``ga`` and ``offline-rl``;
    the module of ``ga`` says why they turn back.
    """

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Look the destination up; raise PolicyError for a scenario without one."""
        name = situation.self.name
        goal = object_destination_m(situation.scenario, situation.map, name)
        if goal is None:
            raise PolicyError(
                f"object policy 'destination': the scenario has no gene '{name}.destination_x'; "
                "only the search methods ga and offline-rl give objects a destination. Choose one "
                "of these (--garl-method), or another policy (--garl-npcs)"
            )
        x, y, _ = situation.self.position_m
        self._goal, self._next = goal, (x, y)

    def decide(self, situation: Situation) -> Move:
        """Go straight there; turn where the way ends."""
        if _arrived(self._goal, situation):
            self._goal, self._next = self._next, self._goal
        return _towards(self._goal, situation)


def _arrived(goal: tuple[float, float], situation: Situation) -> bool:
    """Whether a place is within half a metre, or within the stride of one decision."""
    reach = max(ARRIVED_M, DECISION_STEP_S * situation.self.speed_mps)
    return math.dist(situation.self.position_m[:2], goal) < reach


def _towards(goal: tuple[float, float], situation: Situation) -> Move:
    x, y, _ = situation.self.position_m
    length = math.dist((x, y), goal)
    return Move(x=(goal[0] - x) / length, y=(goal[1] - y) / length) if length > 0 else STAY


POLICIES: Mapping[str, PolicySpec] = MappingProxyType(
    {
        name: PolicySpec(name=name, factory=f"{__name__}:{factory.__name__}")
        for name, factory in (
            ("stationary", Stationary),
            ("waypoint", Waypoint),
            ("random_walk", RandomWalk),
            ("greedy", Greedy),
            ("stand", Stand),
            ("destination", Destination),
        )
    }
)


LEARNED = ("dqn", "dqn-paper", "online-rl")


def policy_spec(name: str) -> PolicySpec:
    """Return the specification of a shipped policy, or of weights in a file.

    Raises PolicyError for an unknown name, and for weights that cannot be trusted.
    """
    if name in POLICIES:
        return POLICIES[name]
    if name not in LEARNED and not name.endswith(".npz"):
        raise PolicyError(
            f"unknown object policy {name!r}; expected one of {', '.join((*LEARNED, *POLICIES))}, "
            "or the path of weights (.npz) that `garl train` wrote"
        )
    from pytest_garl.adversary.learned import learned_spec

    return learned_spec(name)


def check_policy(spec: PolicySpec, map: Map) -> None:
    """Let a policy decide once for each object of a map, before anything is flown.

    Raises PolicyError if it cannot be made, raises, or answers what is no move.
    """
    x_min, x_max, y_min, y_max = map.bounds_m
    genome = with_destinations(genome_for(map))
    states = [
        ObjectState(
            name=name,
            type=OBJECT_TYPES[kind],
            position_m=(x_min, y_min, OBJECT_TYPES[kind].altitude_m),
            velocity_mps=(0.0, 0.0),
            speed_mps=OBJECT_TYPES[kind].top_speed_mps,
        )
        for name, kind in map.object_names
    ]
    for state in states:
        situation = Situation(
            time_s=0.0,
            self=state,
            others=tuple(other for other in states if other is not state),
            uav_position_m=map.uav_start_m,
            uav_velocity_mps=(0.0, 0.0, 0.0),
            marker_position_m=((x_min + x_max) / 2, (y_min + y_max) / 2),
            map=map,
            scenario=decode(genome.nominal, genome, map=map.name, seed=0),
        )
        policy = spec.make()
        try:
            policy.reset(situation, np.random.default_rng(0))
        except PolicyError:
            raise
        except Exception as error:
            raise PolicyError(
                f"object policy {spec.name!r}: reset raised {type(error).__name__}: {error}"
            ) from error
        decision(policy, situation)
