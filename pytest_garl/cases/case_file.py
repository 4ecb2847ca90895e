"""Case files: small, sorted, commented TOML that a person can read, without any code.

The sections stand in the file in the order of ``dump_case``.  The rows of ``case_sections.py`` are
their keys.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from pytest_garl.cases.case import (
    NOT_ASKED,
    Case,
    CaseEvidence,
    ChangeList,
    Changes,
    MoveList,
    Moves,
    Prevention,
    RecordedBehaviour,
    Violation,
    Worst,
)
from pytest_garl.cases.case_header import HEADER_KEYS, header_lines, read_header
from pytest_garl.cases.case_sections import (
    EVIDENCE,
    LIMITS,
    POLICY,
    PREVENTABLE,
    SEVERITY,
    VIOLATION,
    WORST,
    lines_of,
    values_in,
)
from pytest_garl.errors import ScenarioError
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.files.user_files import Table, finite, parse_table, quoted, read_text
from pytest_garl.messages import shown
from pytest_garl.scenarios.files import SCENARIO_KEYS, is_in_units, read_scenario, scenario_lines
from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.task import task_lines
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from pytest_garl.verdicts.verdict import LONGEST_S, Limits

_IN_UNITS = "# What is not nominal; each name ends with its unit, x is east and y north."
_IN_GENES = "# Weather from 0 to 1, places from -1 to 1, velocity as a share of the top speed."
_SECTIONS = {
    *("violation", "severity", "preventable", "limits"),
    *("policy", "moves", "changes", "evidence"),
}
_OF_SHRUNK = {
    "body": "# The adversary that it takes; the weaker, the worse.",
    "conditions": "# The conditions that it takes; the fewer, the worse.",
}
_NOT_SHRUNK = "# Unusual in the flight that was found; the case is not shrunk."


def load_case(path: Path, map_folders: tuple[Path, ...] = ()) -> Case:
    """Return the case in a file; raise ScenarioError that names file and key."""
    return parse_case(read_text(path), lambda name: load_map(name, map_folders), source=str(path))


def dump_case(case: Case, load_map: Callable[[str], Map] = load_map) -> str:
    """Return the case as TOML: the same bytes for equal cases."""
    map = load_map(case.scenario.map)
    sections = [
        header_lines(case, map),
        _violation_lines(case.violation, case.worst),
        *_severity_lines(case.severity, is_shrunk=case.is_shrunk),
        *_prevention_lines(case.prevention),
        ["[limits]", *lines_of(case.limits, LIMITS)],
        [
            _IN_UNITS if is_in_units(case.scenario, map) else _IN_GENES,
            *scenario_lines(case.scenario, map)[1:],
            *task_lines(case.scenario.task),
        ],
        ["# Who moved the objects when this was found.", "[policy]", *lines_of(case, POLICY)],
        *_behaviour_lines(case),
        *_evidence_lines(case.evidence),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections) + "\n"


def parse_case(text: str, load_map: Callable[[str], Map], *, source: str = "case") -> Case:
    """Return the case in ``text``; raise ScenarioError that names source and key."""
    top = parse_table(text, source)
    header = read_header(top)
    top.refuse_unknown(HEADER_KEYS | _SECTIONS | {*SCENARIO_KEYS})
    try:
        map = load_map(header.map)
    except ScenarioError as error:
        raise top.error("map", str(error)) from error
    scenario = read_scenario(top, map)
    removed = scenario.removed_objects
    names = [name for name, _ in map.all_objects if name not in removed]
    violation = top.table("violation")
    return Case(
        system=header.system,
        status=header.status,
        scenario=scenario,
        violation=Violation(**values_in(violation, VIOLATION, beside=WORST)),
        worst=_read_worst(violation),
        **values_in(top.table("policy"), POLICY),
        moves=read_moves(top.table("moves"), names),
        changes=read_changes(top.table("changes"), names) if "changes" in top.values else (),
        evidence=CaseEvidence(**values_in(top.table("evidence"), EVIDENCE)),
        limits=read_limits(top.table("limits")),
        test=top.string("test", ""),
        assertion=top.string("assertion", ""),
        accepted=top.boolean("accepted", default=False),
        reason=header.reason,
        live=header.live,
        prevention=_read_prevention(top),
        severity=_read_severity(top),
    )


def record_lines(case: Case) -> list[str]:
    """Return the lines that hold the moves of the objects and their policies' changes."""
    return [*move_lines(case.behaviour), *change_lines(case.behaviour)]


def size_of(case: Case, map: Map) -> int:
    """Return how many characters the scenario and the recorded behaviour take in the file."""
    lines = (*scenario_lines(case.scenario, map), *record_lines(case))
    return sum(len(line) for line in lines)


def _violation_lines(violation: Violation, worst: Worst | None) -> list[str]:
    *lines, story = lines_of(violation, VIOLATION)
    return ["[violation]", *lines, *(lines_of(worst, WORST) if worst else []), story]


def _read_worst(table: Table) -> Worst | None:
    if "worst_margin" in table.values:
        return Worst(**values_in(table, WORST, beside=VIOLATION))
    if "weakest_grade" in table.values:
        raise table.error("weakest_grade", "found a grade, expected one beside worst_margin")
    return None


def _severity_lines(severity: Severity, *, is_shrunk: bool) -> list[list[str]]:
    if not severity.about:
        return []
    comment = _OF_SHRUNK[severity.about] if is_shrunk else _NOT_SHRUNK
    return [[comment, "[severity]", *lines_of(severity, SEVERITY[severity.about])]]


def _read_severity(top: Table) -> Severity:
    if "severity" not in top.values:
        return NO_SEVERITY
    table = top.table("severity")
    about: Literal["body", "conditions"] = "conditions" if "conditions" in table.values else "body"
    severity = Severity(about=about, **values_in(table, SEVERITY[about]))
    if len(severity.values) != len(severity.conditions):
        expected = f"one text for each of {len(severity.conditions)} conditions"
        raise table.error("values", f"found {len(severity.values)} texts, expected {expected}")
    return severity


def _prevention_lines(prevention: Prevention) -> list[list[str]]:
    if prevention == NOT_ASKED:
        return []
    comment = "# Could it have been prevented? Seconds before the contact."
    return [[comment, "[preventable]", *lines_of(prevention, PREVENTABLE)]]


def _read_prevention(top: Table) -> Prevention:
    if "preventable" not in top.values:
        return NOT_ASKED
    table = top.table("preventable")
    if "inevitable_s" not in table.values:
        raise table.error("inevitable_s", "found nothing, expected a number of seconds")
    return Prevention(**values_in(table, PREVENTABLE))


def read_limits(table: Table) -> Limits:
    """Return the limits in a table of their own."""
    return Limits(**values_in(table, LIMITS))


def _behaviour_lines(case: Case) -> list[list[str]]:
    moves = [
        "# What they did: [times, x, y], each for half a second; x east and y north as shares of",
        "# the object's speed. After the last they leave the marker's surroundings.",
        "[moves]",
        *move_lines(case.behaviour),
    ]
    if not case.changes:
        return [moves]
    changes = [
        "# What their policies changed of the environment: [decision, gene, added to it], the",
        "# number of the decision from 0, two a second.",
        "[changes]",
        *change_lines(case.behaviour),
    ]
    return [moves, changes]


def _evidence_lines(evidence: CaseEvidence) -> list[list[str]]:
    above = [key for key in EVIDENCE if key.name != "versions"]
    versions = [f"{quoted(name)} = {quoted(version)}" for name, version in evidence.versions]
    return [["[evidence]", *lines_of(evidence, above)], ["[evidence.versions]", *versions]]


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
        if not math.hypot(x, y) <= 1 + 1e-9:
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
