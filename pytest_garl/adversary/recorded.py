"""Objects that repeat what was recorded, so that a saved case needs no policy."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.simulation.policy import STAY, Move, PolicySpec, Situation

Moves = Mapping[str, Sequence[tuple[float, float]]]
"""The wanted velocities (x, y) of each object, one for every half second, as shares of its
speed."""


class Recorded:
    """Repeats an object's moves, decision by decision, and stands still when they end."""

    def __init__(self, moves: str) -> None:
        self._all: dict[str, list[list[float]]] = json.loads(moves)

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Begin with the first move."""
        name = situation.self.name
        if name not in self._all:
            raise PolicyError(
                f"recorded moves: none for {name}; there are those of {', '.join(self._all)}"
            )
        self._moves = iter(self._all[name])

    def decide(self, situation: Situation) -> Move:
        """Repeat the next move."""
        move = next(self._moves, None)
        return STAY if move is None else Move(x=move[0], y=move[1])


def recorded_spec(moves: Moves) -> PolicySpec:
    """Return the specification of objects that repeat ``moves``."""
    text = json.dumps({name: [list(pair) for pair in each] for name, each in moves.items()})
    return PolicySpec(
        name="recorded", factory=f"{__name__}:{Recorded.__name__}", arguments=(("moves", text),)
    )
