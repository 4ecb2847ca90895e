"""Shorter records of moves: fewer digits, and an object that stands still at first."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pytest_garl.cases.case import MoveList, Moves, RecordedBehaviour
from pytest_garl.flight.flight import Flight
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import start_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import problems
from pytest_garl.simulation.npc_policy import DECISION_STEP_S

LAST_MOVES_S = (2.0, 4.0, 8.0)
"""Times before the end of the flight in which an object moves, tried from short to long."""


def shorter_records(
    scenario: Scenario, moves: Moves, flight: Flight, name: str, map: Map
) -> Iterator[tuple[Scenario, Moves]]:
    """Yield scenarios with shorter records, the shortest first.

    In the first scenarios the object ``name`` starts where it was shortly before the end of the
    flight, and stands there until then; impossible places, such as on the marker, are left out.
    In all scenarios moves are whole hundredths, so that more of them are equal and form one run.
    """
    yield from _with_later_moves(scenario, moves, flight, name, map)
    yield scenario, tuple((each, _rounded(own)) for each, own in moves)


def rounded(behaviour: RecordedBehaviour) -> RecordedBehaviour:
    """Return the behaviour with moves in whole hundredths."""
    moves = tuple((name, _rounded(own)) for name, own in behaviour.moves)
    return RecordedBehaviour(moves=moves, changes=behaviour.changes)


def shortened(behaviour: RecordedBehaviour) -> RecordedBehaviour:
    """Return the behaviour with four digits after the point, no move longer than it was.

    A file of many moves stays short.  It is another behaviour: it must be flown before it is saved.
    """
    moves = tuple(
        (name, tuple((_short(x), _short(y)) for x, y in own)) for name, own in behaviour.moves
    )
    return RecordedBehaviour(moves=moves, changes=behaviour.changes)


def _short(share: float) -> float:
    near = round(share, 4)
    if abs(near) > abs(share):
        near = round(near - math.copysign(1e-4, near), 4)
    return near + 0.0  # no negative zero


def _rounded(moves: MoveList) -> MoveList:
    return tuple(_round(x, y) for x, y in moves)


def _round(x: float, y: float) -> tuple[float, float]:
    """Return a move in whole hundredths that is no longer than 1, without negative zeros."""
    x, y = round(x, 2) + 0.0, round(y, 2) + 0.0
    while math.hypot(x, y) > 1:
        x, y = (round(v - math.copysign(0.01, v), 2) + 0.0 if v else v for v in (x, y))
    return x, y


def _with_later_moves(
    scenario: Scenario, moves: Moves, flight: Flight, name: str, map: Map
) -> Iterator[tuple[Scenario, Moves]]:
    # A user's own simulator may not record its objects.
    track = next((item.track for item in flight.objects if item.name == name), None)
    own = dict(moves).get(name, ())
    if track is None:
        return
    for moving_s in LAST_MOVES_S:
        wait = len(own) - round(moving_s / DECISION_STEP_S)
        # An object that stands at first already needs no change.
        if wait <= 0 or all(move == (0.0, 0.0) for move in own[:wait]):
            continue
        index = min(len(track.time_s) - 1, int(track.time_s.searchsorted(wait * DECISION_STEP_S)))
        # Whole centimetres: few digits, and a place that the case's file can write.
        x, y = (round(float(value), 2) for value in track.position_m[index, :2])
        there = scenario.replace(start_genes(name, (x, y), map))
        if problems(there, map):
            continue
        still: MoveList = ((0.0, 0.0),) * wait + own[wait:]
        yield (
            there,
            tuple((each, _rounded(still if each == name else its)) for each, its in moves),
        )
