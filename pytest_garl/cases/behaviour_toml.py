"""Recorded behaviour in a case file: moves in runs of equal ones, changes of the environment."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from pytest_garl.cases.case import ChangeList, Changes, MoveList, Moves, RecordedBehaviour
from pytest_garl.files.toml import Table, finite, quoted
from pytest_garl.messages import shown
from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from pytest_garl.verdicts.verdict import LONGEST_S

MOST_MOVES = round(LONGEST_S / DECISION_STEP_S)
"""Moves of an object in the longest flight."""


def move_lines(behaviour: RecordedBehaviour) -> list[str]:
    """Return a line for each object: its moves as a list of [times, x, y]."""
    return [f"{name} = {_dump_moves(moves)}" for name, moves in behaviour.moves]


def change_lines(behaviour: RecordedBehaviour) -> list[str]:
    """Return a line for each object that changed the environment: [decision, gene, added value]."""
    return [f"{name} = {_dump_changes(changes)}" for name, changes in behaviour.changes]


def read_moves(table: Table, names: Sequence[str]) -> Moves:
    """Return the moves of the named objects; raise ScenarioError that names the key."""
    table.refuse_unknown(names)
    return tuple((name, _read_runs(table, name)) for name in names)


def read_changes(table: Table, names: Sequence[str]) -> Changes:
    """Return the changes by the named objects; raise ScenarioError that names the key."""
    table.refuse_unknown(names)
    return tuple((name, _read_changes(table, name)) for name in names if name in table.values)


def _dump_moves(moves: MoveList) -> str:
    # Compared as text: -0.0 equals 0.0 but is another number.
    runs = [
        (len(list(run)), text) for text, run in itertools.groupby(f"{x!r}, {y!r}" for x, y in moves)
    ]
    return f"[{', '.join(f'[{count}, {text}]' for count, text in runs)}]"


def _dump_changes(changes: ChangeList) -> str:
    rows = (f"[{decision}, {quoted(key)}, {added!r}]" for decision, key, added in changes)
    return f"[{', '.join(rows)}]"


def _read_runs(table: Table, name: str) -> MoveList:
    runs = table.get(name)
    expected = "expected a list of [times, x, y] with times of at least 1 and x² + y² of at most 1"
    if not isinstance(runs, list):
        raise table.error(name, f"found {shown(runs)}, {expected}")
    moves: list[tuple[float, float]] = []
    for run in runs:
        times, x, y = run if isinstance(run, list) and len(run) == 3 else (0, None, None)
        x, y = finite(x), finite(y)
        if type(times) is not int or times < 1 or x is None or y is None:
            raise table.error(name, f"found {shown(run)}, {expected}")
        if not max(abs(x), abs(y)) <= 1 or not x**2 + y**2 <= 1 + 1e-9:
            raise table.error(name, f"found {shown(run)}, {expected}")
        if len(moves) + times > MOST_MOVES:
            raise table.error(
                name,
                f"found {shown(run)} after {len(moves)} moves, expected at most {MOST_MOVES} "
                f"moves in all: no flight is longer than {LONGEST_S:g} s",
            )
        moves += [(x, y)] * times
    return tuple(moves)


def _read_changes(table: Table, name: str) -> ChangeList:
    rows = table.get(name)
    expected = f"expected a list of [decision, gene, number] with one of {', '.join(ENVIRONMENT)}"
    if not isinstance(rows, list):
        raise table.error(name, f"found {shown(rows)}, {expected}")
    wrong = next((row for row in rows if not _is_change(row)), None)
    if wrong is not None:
        raise table.error(name, f"found {shown(wrong)}, {expected}")
    return tuple((row[0], row[1], float(row[2])) for row in rows)


def _is_change(row: object) -> bool:
    if not isinstance(row, list) or [type(item) for item in row[:2]] != [int, str]:
        return False
    return (
        len(row) == 3
        and 0 <= row[0] < MOST_MOVES
        and row[1] in ENVIRONMENT
        and finite(row[2]) is not None
    )
