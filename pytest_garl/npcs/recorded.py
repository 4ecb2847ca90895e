"""NPCs that repeat recorded moves, so that a saved case needs no policy."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.exit_path import ExitPath
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, PolicySpec, Situation

Moves = Mapping[str, Sequence[tuple[float, float]]]
"""The moves (x, y) of each NPC, one for every half second, as shares of its speed."""
Changes = Mapping[str, Sequence[tuple[int, str, float]]]
"""The changes of the environment by each NPC's policy: (decision, gene, amount added)."""
NONE: Changes = MappingProxyType({})


class Recorded:
    """Repeats an NPC's moves, decision by decision, and leaves the landing zone when they end.

    A record ends when the UAV was hit.  If the NPC stood on the marker from then on, a repaired
    landing system that waits could never land.  The policy's changes of the environment are
    repeated at the same decisions.
    """

    reads_uav = False
    grade = ""

    def __init__(self, moves: str, changes: str = "{}") -> None:
        self._all: dict[str, list[list[float]]] = json.loads(moves)
        self._changes: dict[str, list[tuple[int, str, float]]] = json.loads(changes)

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Begin with the first move; raise PolicyError if the NPC has no recorded moves."""
        name = situation.self.name
        if name not in self._all:
            found = ", ".join(self._all) or "nobody"
            raise PolicyError(f"recorded moves: none for {name}; found moves of {found}")
        self._moves = enumerate(self._all[name])
        self._own = self._changes.get(name, [])
        self._last: tuple[float, float] = (0.0, 0.0)
        self._exit: ExitPath | None = None

    def decide(self, situation: Situation) -> Move:
        """Repeat the next move."""
        number, move = next(self._moves, (-1, None))
        if move is None and self._exit is None:
            # Wait one decision: the flight of a shortened record may last a moment longer.
            self._exit = ExitPath(situation, self._last)
            return STAY
        if move is None:
            assert self._exit is not None
            return self._exit.decide(situation)
        self._last = (move[0], move[1])
        changes = tuple((key, by) for decision, key, by in self._own if decision == number)
        return Move(x=move[0], y=move[1], changes=changes)


class HandedOver:
    """Repeats an NPC's moves for some decisions; from then on another policy decides.

    That policy is asked at every decision, so that it has seen the whole flight when its moves
    count.
    """

    grade = ""

    def __init__(self, decisions: int, live: str, moves: str, changes: str = "{}") -> None:
        name, factory, arguments = json.loads(live)
        self._recorded = Recorded(moves, changes)
        self._live = PolicySpec(
            name=name, factory=factory, arguments=tuple((key, value) for key, value in arguments)
        ).make()
        self._left = decisions

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Begin with the first move."""
        self._recorded.reset(situation, rng)
        self._live.reset(situation, rng)

    def decide(self, situation: Situation) -> Move:
        """Repeat the next move, or let the other policy decide."""
        live = self._live.decide(situation)
        if self._left > 0:
            self._left -= 1
            return self._recorded.decide(situation)
        return live


def handed_over_spec(recorded: PolicySpec, live: PolicySpec, time_s: float) -> PolicySpec:
    """Return the specification of NPCs that repeat ``recorded`` until a time, then follow ``live``.

    Decisions before ``time_s`` are repeated.
    """
    decisions = math.ceil(time_s / DECISION_STEP_S - 1e-9)
    facts = json.dumps([live.name, live.factory, [list(each) for each in live.arguments]])
    return PolicySpec(
        name=f"recorded, then {live.name}",
        factory=f"{__name__}:{HandedOver.__name__}",
        arguments=(("decisions", decisions), ("live", facts), *recorded.arguments),
    )


def recorded_spec(moves: Moves, changes: Changes = NONE) -> PolicySpec:
    """Return the specification of NPCs that repeat ``moves`` and ``changes``."""
    text = json.dumps({name: [list(pair) for pair in each] for name, each in moves.items()})
    arguments = [("moves", text)]
    if any(changes.values()):
        arguments.append(("changes", json.dumps({name: [*own] for name, own in changes.items()})))
    return PolicySpec(
        name="recorded",
        factory=f"{__name__}:{Recorded.__name__}",
        arguments=tuple(arguments),
    )
