"""Input and output of a learned NPC policy: situations as numbers, actions as moves."""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from pytest_garl.npcs.interference import Belief
from pytest_garl.scenarios.genes import CONFINED_WEATHER, SUN
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, Situation

State = NDArray[np.float32]

ACTIONS: tuple[Move, ...] = (
    Move(x=0.0, y=1.0),
    Move(x=0.0, y=-1.0),
    Move(x=-1.0, y=0.0),
    Move(x=1.0, y=0.0),
    Move(x=0.0, y=0.0),
)
"""The paper's actions: up, down, left, right, stationary (up is north)."""

PLACE_SCALE_M = 10.0
SPEED_SCALE_MPS = 3.0
STEP_SCALE_M = 4.0
BODY_SCALE_M = 3.0
LEFT_SCALE_S = 5.0
"""Divisors of each kind of number, so that all numbers are of the order of one."""
LIMIT = 10.0
"""Bound of every number, however large the map."""
CONDITIONS = (
    "environment.dust",
    "environment.fog",
    "environment.rain",
    "environment.snow",
    "environment.road_wetness",
    "environment.maple_leaf",
    "environment.road_leaf",
    "environment.road_snow",
    SUN,
)
"""The paper's nine genes of the environment; weights depend on their number and order."""
CONDITION_STEP = 0.01
"""Change of a condition in one action of the paper's Online RL."""


def paper(situation: Situation) -> State:
    """Return NPC - marker and UAV - marker in the plane (4,), in metres / 10.

    Paper, section 3.4: the state S.
    """
    return _vector(_places(situation))


def extended(situation: Situation) -> State:
    """Return nine numbers: the paper's four, and five to choose the moment.

    These are the UAV's height and vertical speed, the distance that the NPC can go in one
    decision, and the heights of its top and bottom.
    """
    return _vector(
        (
            *_places(situation),
            situation.uav_position_m[2] / PLACE_SCALE_M,
            situation.uav_velocity_mps[2] / SPEED_SCALE_MPS,
            *_step_and_heights(situation),
        )
    )


def relative(situation: Situation) -> State:
    """Return ten numbers in the frame of the NPC, whose x axis points to the UAV's column.

    Distance to the column; UAV - marker; the UAV's height and vertical speed; the NPC's step, top
    and bottom; its velocity.  A landing looks the same from all sides, so a policy learns it once
    for all of them.
    """
    ox, oy, _ = situation.self.position_m
    ux, uy, height = situation.uav_position_m
    mx, my = situation.marker_position_m
    ahead, aside = in_own_frame(situation, ux - mx, uy - my)
    forward, sideways = in_own_frame(situation, *situation.self.velocity_mps)
    return _vector(
        (
            math.dist((ox, oy), (ux, uy)) / PLACE_SCALE_M,
            ahead / PLACE_SCALE_M,
            aside / PLACE_SCALE_M,
            height / PLACE_SCALE_M,
            situation.uav_velocity_mps[2] / SPEED_SCALE_MPS,
            *_step_and_heights(situation),
            forward / SPEED_SCALE_MPS,
            sideways / SPEED_SCALE_MPS,
        )
    )


def belief(situation: Situation) -> State:
    """Return twelve numbers: ``relative`` to where the UAV is believed to be, and two of the grade.

    These are how long the NPC still interferes, and whether it keeps away from the UAV.  Raises
    TypeError for a situation that is no ``Belief``.
    """
    if not isinstance(situation, Belief):
        raise TypeError(f"expected a Belief, found {type(situation).__name__}")
    own = (situation.left_s / LEFT_SCALE_S, float(situation.keeps_m > 0))
    return np.concatenate([relative(situation), _vector(own)])


def online(situation: Situation) -> State:
    """Return the paper's four, the environment's nine properties and the marker's genes, (15,).

    The state of the paper's Online RL "encodes the environment, marker position, and dynamic
    objects' start points".  As in its code the places are the current ones of the NPC and the UAV.
    Unlike there they are relative to the marker both in training and in flight.  Weather is a share
    of the confined range, which the policy never leaves.
    """
    scenario = situation.scenario
    conditions = [scenario[key] / _range(key) for key in CONDITIONS]
    return _vector((*_places(situation), *conditions, scenario["marker.x"], scenario["marker.y"]))


def online_moves(situation: Situation) -> tuple[Move, ...]:
    """Return the paper's five moves, then each of nine conditions up and down, (23,).

    There are as many as in the paper's code: eight weathers by ±0.01, and time of day.  No weather
    is raised beyond the confined range, the only one that the policy was trained in.
    """
    changes = []
    for key in CONDITIONS:
        value = situation.scenario[key]
        up = max(0.0, min(CONDITION_STEP, _range(key) - value))
        changes += [(key, up), (key, -min(CONDITION_STEP, value))]
    return *ACTIONS, *(Move(x=0.0, y=0.0, changes=(each,)) if each[1] else STAY for each in changes)


def on_turn(situation: Situation) -> bool:
    """Whether this NPC acts, if one of all NPCs is drawn for each decision.

    Each NPC has its own generator, and they share none.  So the draw is a hash of values that all
    of them see.
    """
    names = sorted(each.name for each in (situation.self, *situation.others))
    seen = struct.pack("<3d", situation.time_s, *situation.marker_position_m)
    draw = int.from_bytes(hashlib.blake2b(seen, digest_size=8).digest(), "little")
    return names[draw % len(names)] == situation.self.name


def compass_moves(situation: Situation) -> tuple[Move, ...]:
    """Return the moves of the paper's actions: north, south, west, east, stay."""
    return ACTIONS


def relative_moves(situation: Situation) -> tuple[Move, ...]:
    """Return the moves of actions in the NPC's frame: left, right, back, ahead, stay."""
    cos, sin = _heading(situation)
    return tuple(Move(x=cos * m.x - sin * m.y, y=sin * m.x + cos * m.y) for m in ACTIONS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Encoding:
    """Turns a situation into the input of a network, and its actions into moves.

    ``size`` is the length of the state.  ``one_npc_acts`` is whether at each decision one NPC acts,
    drawn at random, and all others stay.  ``is_belief`` is whether the state is that of a belief.
    """

    size: int
    state: Callable[[Situation], State]
    moves: Callable[[Situation], tuple[Move, ...]]
    actions: int = len(ACTIONS)
    one_npc_acts: bool = False
    is_belief: bool = False


ENCODINGS: Mapping[str, Encoding] = MappingProxyType(
    {
        "paper": Encoding(size=4, state=paper, moves=compass_moves),
        "extended": Encoding(size=9, state=extended, moves=compass_moves),
        "relative": Encoding(size=10, state=relative, moves=relative_moves),
        "belief": Encoding(size=12, state=belief, moves=relative_moves, is_belief=True),
        "online": Encoding(
            size=4 + len(CONDITIONS) + 2,
            state=online,
            moves=online_moves,
            actions=len(ACTIONS) + 2 * len(CONDITIONS),
            one_npc_acts=True,
        ),
    }
)
"""Each encoding by the name that a policy's manifest gives."""


def _heading(situation: Situation) -> tuple[float, float]:
    """Return cosine and sine of the direction from the NPC to the UAV's column."""
    ox, oy, _ = situation.self.position_m
    ux, uy, _ = situation.uav_position_m
    length = math.dist((ox, oy), (ux, uy))
    return ((ux - ox) / length, (uy - oy) / length) if length > 0 else (1.0, 0.0)


def in_own_frame(situation: Situation, x: float, y: float) -> tuple[float, float]:
    """Return a vector in the NPC's frame, whose x axis points to the UAV's column."""
    cos, sin = _heading(situation)
    return cos * x + sin * y, cos * y - sin * x


def _step_and_heights(situation: Situation) -> tuple[float, float, float]:
    """Return the NPC's way in one decision, and the heights of its top and bottom."""
    body = situation.self
    return (
        situation.self.speed_mps * DECISION_STEP_S / STEP_SCALE_M,
        body.top_m / BODY_SCALE_M,
        body.bottom_m / BODY_SCALE_M,
    )


def _range(key: str) -> float:
    return 1.0 if key == SUN else CONFINED_WEATHER


def _vector(numbers: Sequence[float]) -> State:
    return np.clip(np.array(numbers, dtype=np.float32), -LIMIT, LIMIT)


def _places(situation: Situation) -> tuple[float, float, float, float]:
    mx, my = situation.marker_position_m
    ox, oy, _ = situation.self.position_m
    ux, uy, _ = situation.uav_position_m
    return (
        (ox - mx) / PLACE_SCALE_M,
        (oy - my) / PLACE_SCALE_M,
        (ux - mx) / PLACE_SCALE_M,
        (uy - my) / PLACE_SCALE_M,
    )
