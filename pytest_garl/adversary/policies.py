"""Unlearned policies: objects that stand, wander, walk to destinations or over the marker."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.scenarios.maps import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.simulation.policy import (
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
        x, y, _ = situation.self.position_m
        if math.dist((x, y), self._goal) < max(ARRIVED_M, 0.5 * situation.self.speed_mps):
            self._draw(situation)
        dx, dy = self._goal[0] - x, self._goal[1] - y
        length = math.hypot(dx, dy)
        return Move(x=dx / length, y=dy / length) if length > 0 else STAY

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
        self._move = _towards_marker(situation)

    def decide(self, situation: Situation) -> Move:
        """Go straight to the marker, and on beyond it by one decision."""
        stride = situation.self.speed_mps * DECISION_STEP_S
        if math.dist(situation.self.position_m[:2], situation.marker_position_m) > stride:
            self._move = _towards_marker(situation)
        return self._move


class Stand:
    """Walks to the marker and stands on it."""

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def decide(self, situation: Situation) -> Move:
        """Go to the marker, slower over the last step, and stay."""
        stride = situation.self.speed_mps * DECISION_STEP_S
        distance = math.dist(situation.self.position_m[:2], situation.marker_position_m)
        move = _towards_marker(situation)
        share = min(1.0, distance / stride) if stride > 0 else 0.0
        return Move(x=share * move.x, y=share * move.y)


def _towards_marker(situation: Situation) -> Move:
    (x, y, _), (mx, my) = situation.self.position_m, situation.marker_position_m
    length = math.dist((x, y), (mx, my))
    return Move(x=(mx - x) / length, y=(my - y) / length) if length > 0 else STAY


POLICIES: Mapping[str, PolicySpec] = MappingProxyType(
    {
        name: PolicySpec(name=name, factory=f"{__name__}:{factory.__name__}")
        for name, factory in (
            ("stationary", Stationary),
            ("waypoint", Waypoint),
            ("random_walk", RandomWalk),
            ("greedy", Greedy),
            ("stand", Stand),
        )
    }
)


LEARNED = ("dqn", "dqn-paper")


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
    from pytest_garl.adversary.network import learned_spec

    return learned_spec(name)


def check_policy(spec: PolicySpec, map: Map) -> None:
    """Let a policy decide once for each object of a map, before anything is flown.

    Raises PolicyError if it cannot be made, raises, or answers what is no move.
    """
    x_min, x_max, y_min, y_max = map.bounds_m
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
        )
        policy = spec.make()
        try:
            policy.reset(situation, np.random.default_rng(0))
        except Exception as error:
            raise PolicyError(
                f"object policy {spec.name!r}: reset raised {type(error).__name__}: {error}"
            ) from error
        decision(policy, situation)
