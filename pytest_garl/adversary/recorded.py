"""NPCs that repeat recorded moves, so that a saved case needs no policy."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, PolicySpec, Situation

Moves = Mapping[str, Sequence[tuple[float, float]]]
"""The moves (x, y) of each NPC, one for every half second, as shares of its speed."""
Changes = Mapping[str, Sequence[tuple[int, str, float]]]
"""The changes of the environment by each NPC's policy: (decision, gene, amount added)."""
NONE: Changes = MappingProxyType({})
LANDING_ZONE_M = 5.0
"""Horizontal distance from the marker's centre at which an NPC is out of the way.  Engineering
estimate: half the UAV and half a bird's span are 1.2 m together; the rest is room to drift."""
_STUCK = 0.1
"""An NPC that moves less in one decision than this share of its speed is blocked."""
_TURN_RAD = math.radians(70)
"""Not a divisor of a full turn, so that each attempt has another direction."""


class Recorded:
    """Repeats an NPC's moves, decision by decision, and leaves the landing zone when they end.

    A record ends when the UAV was hit.  If the NPC stood on the marker from then on, a repaired
    landing system that waits could never land.  The policy's changes of the environment are
    repeated at the same decisions.
    """

    reads_uav = False

    def __init__(self, moves: str, changes: str = "{}") -> None:
        self._all: dict[str, list[list[float]]] = json.loads(moves)
        self._changes: dict[str, list[tuple[int, str, float]]] = json.loads(changes)

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Begin with the first move."""
        name = situation.self.name
        if name not in self._all:
            raise PolicyError(
                f"recorded moves: none for {name}; found moves of {', '.join(self._all)}"
            )
        self._moves = enumerate(self._all[name])
        self._own = self._changes.get(name, [])
        self._last: tuple[float, float] = (0.0, 0.0)
        self._exit: _Exit | None = None

    def decide(self, situation: Situation) -> Move:
        """Repeat the next move."""
        number, move = next(self._moves, (-1, None))
        if move is None and self._exit is None:
            # Wait one decision: the flight of a shortened record may last a moment longer.
            self._exit = _Exit(situation, self._last)
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


class _Exit:
    """The way out of the landing zone: straight on, or away from the marker if the NPC stood.

    An NPC that is blocked turns, first away from the marker, then further from there.
    """

    def __init__(self, situation: Situation, last: tuple[float, float]) -> None:
        self._heading = math.atan2(last[1], last[0]) if any(last) else _away(situation)
        self._place: tuple[float, float] | None = None
        self._waited, self._turns = 0, 0
        self._has_left = False

    def decide(self, situation: Situation) -> Move:
        """Return the next move: at full speed until the NPC has left the landing zone."""
        x, y, _ = situation.self.position_m
        me = situation.self
        # A bird that stays where it is circles there.
        circle_m = 2 * me.type.turn_radius_m if me.speed_mps > 0 else 0.0
        away_m = math.dist((x, y), situation.marker_position_m)
        self._has_left |= away_m >= LANDING_ZONE_M + circle_m
        if self._has_left:
            return STAY
        least = _STUCK * situation.self.speed_mps * DECISION_STEP_S
        stuck = self._place is not None and math.dist((x, y), self._place) < least
        # Twice in a row, because an NPC that turns back stands for a moment.
        self._waited = self._waited + 1 if stuck else 0
        if self._waited == 2:
            self._heading = _away(situation) + self._turns * _TURN_RAD
            self._turns, self._waited = self._turns + 1, 0
        self._place = (x, y)
        return Move(x=math.cos(self._heading), y=math.sin(self._heading))


def _away(situation: Situation) -> float:
    """Return the direction from the marker to the NPC; east if it stands on the centre."""
    x, y, _ = situation.self.position_m
    mx, my = situation.marker_position_m
    return math.atan2(y - my, x - mx)


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
