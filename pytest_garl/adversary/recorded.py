"""Objects that repeat what was recorded, so that a saved case needs no policy."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.simulation.policy import STAY, Move, PolicySpec, Situation

Moves = Mapping[str, Sequence[tuple[float, float]]]
"""The wanted velocities (x, y) of each object, one for every half second, as shares of its
speed."""
Changes = Mapping[str, Sequence[tuple[int, str, float]]]
"""What each object's policy changed of the environment: (decision, gene, what was added)."""


NONE: Changes = MappingProxyType({})


class Recorded:
    """Repeats an object's moves, decision by decision, and stands still when they end.

    What its policy changed of the environment is changed again, at the same decisions.
    """

    def __init__(self, moves: str, changes: str = "{}") -> None:
        self._all: dict[str, list[list[float]]] = json.loads(moves)
        self._changes: dict[str, list[tuple[int, str, float]]] = json.loads(changes)

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Begin with the first move."""
        name = situation.self.name
        if name not in self._all:
            raise PolicyError(
                f"recorded moves: none for {name}; there are those of {', '.join(self._all)}"
            )
        self._moves = enumerate(self._all[name])
        self._own = self._changes.get(name, [])

    def decide(self, situation: Situation) -> Move:
        """Repeat the next move."""
        number, move = next(self._moves, (-1, None))
        if move is None:
            return STAY
        changes = tuple((key, by) for decision, key, by in self._own if decision == number)
        return Move(x=move[0], y=move[1], changes=changes)


def recorded_spec(moves: Moves, changes: Changes = NONE) -> PolicySpec:
    """Return the specification of objects that repeat ``moves`` and ``changes``."""
    text = json.dumps({name: [list(pair) for pair in each] for name, each in moves.items()})
    arguments = [("moves", text)]
    if any(changes.values()):
        arguments.append(("changes", json.dumps({name: [*own] for name, own in changes.items()})))
    return PolicySpec(
        name="recorded",
        factory=f"{__name__}:{Recorded.__name__}",
        arguments=tuple(arguments),
    )
