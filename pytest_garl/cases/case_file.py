"""Case files: small, sorted, commented TOML that a person can read, without any code.

The sections stand in the file in the order of the functions here.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast, get_args

from pytest_garl.cases.case import (
    NOT_ASKED,
    Case,
    CaseEvidence,
    ChangeList,
    Changes,
    Escape,
    MoveList,
    Moves,
    Preventable,
    Prevention,
    RecordedBehaviour,
    Violation,
    Worst,
)
from pytest_garl.cases.case_header import (
    HEADER_KEYS,
    header_lines,
    read_header,
)
from pytest_garl.engine import Engine
from pytest_garl.errors import ScenarioError
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.files.bounded_files import read_text
from pytest_garl.files.toml import Table, finite, parse_table, quoted
from pytest_garl.messages import printable, shown
from pytest_garl.scenarios.files import SCENARIO_KEYS, is_in_units, read_scenario, scenario_lines
from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.story import GRADES
from pytest_garl.scenarios.task import task_lines
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from pytest_garl.verdicts.verdict import (
    FARTHEST_M,
    LONGEST_S,
    AbortRule,
    Limits,
    PropertyName,
    ViolationType,
)

_IN_UNITS = "# What is not nominal; each name ends with its unit, x is east and y north."
_IN_GENES = "# Weather from 0 to 1, places from -1 to 1, velocity as a share of the top speed."
_SECTIONS = {
    "violation",
    "severity",
    "preventable",
    "limits",
    "task",
    "policy",
    "moves",
    "changes",
    "evidence",
}
_VIOLATION_KEYS = {
    *("signature", "type", "property", "margin", "unit", "story"),
    *("worst_margin", "weakest_grade"),
}


def load_case(path: Path, map_folders: tuple[Path, ...] = ()) -> Case:
    """Return the case in a file; raise ScenarioError that names file and key."""
    return parse_case(read_text(path), lambda name: load_map(name, map_folders), source=str(path))


def dump_case(case: Case, load_map: Callable[[str], Map] = load_map) -> str:
    """Return the case as TOML: the same bytes for equal cases."""
    map = load_map(case.scenario.map)
    sections = [
        header_lines(case, map),
        _violation_lines(case.violation, case.worst),
        *severity_lines(case.severity, is_shrunk=case.is_shrunk),
        *_prevention_lines(case.prevention),
        _limits_lines(case.limits),
        [
            _IN_UNITS if is_in_units(case.scenario, map) else _IN_GENES,
            *scenario_lines(case.scenario, map)[1:],
            *task_lines(case.scenario.task),
        ],
        _policy_lines(case),
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
    policy = top.table("policy")
    policy.refuse_unknown({"name", "sha256"})
    return Case(
        system=header.system,
        status=header.status,
        scenario=scenario,
        violation=_read_violation(top.table("violation")),
        worst=_read_worst(top.table("violation")),
        policy=policy.string("name"),
        policy_sha256=policy.string("sha256"),
        moves=read_moves(top.table("moves"), names),
        changes=read_changes(top.table("changes"), names) if "changes" in top.values else (),
        evidence=_read_evidence(top.table("evidence")),
        limits=read_limits(top.table("limits")),
        test=top.string("test", ""),
        assertion=top.string("assertion", ""),
        accepted=top.boolean("accepted", default=False),
        reason=header.reason,
        live=header.live,
        prevention=_read_prevention(top),
        severity=read_severity(top),
    )


def record_lines(case: Case) -> list[str]:
    """Return the lines that hold the moves of the objects and their policies' changes."""
    return [*move_lines(case.behaviour), *change_lines(case.behaviour)]


def size_of(case: Case, map: Map) -> int:
    """Return how many characters the scenario and the recorded behaviour take in the file."""
    lines = (*scenario_lines(case.scenario, map), *record_lines(case))
    return sum(len(line) for line in lines)


def _prevention_lines(prevention: Prevention) -> list[list[str]]:
    if prevention == NOT_ASKED:
        return []
    seconds = (
        ("inevitable_s", prevention.inevitable_s, "from then on no escape exists"),
        ("observed_s", prevention.observed_s, "the camera first showed the body well enough"),
    )
    lines = [
        "# Could it have been prevented? Seconds before the contact.",
        "[preventable]",
        f'answer = "{prevention.answer}"',
        *(f"{key} = {value!r}  # {text}" for key, value, text in seconds if value is not None),
    ]
    if prevention.escape != "flight":
        lines.append(f'escape = "{prevention.escape}"  # of a UAV that stands on the ground')
    return [lines]


def _read_prevention(top: Table) -> Prevention:
    if "preventable" not in top.values:
        return NOT_ASKED
    table = top.table("preventable")
    table.refuse_unknown({"answer", "inevitable_s", "observed_s", "escape"})
    seconds = {
        key: table.number(key, low=0.0, high=LONGEST_S)
        for key in ("inevitable_s", "observed_s")
        if key in table.values
    }
    answer = cast(Preventable, table.string("answer", allowed=get_args(Preventable)[1:]))
    if "inevitable_s" not in seconds:
        raise table.error("inevitable_s", "found nothing, expected a number of seconds")
    escape: Escape = "flight"
    if "escape" in table.values:
        escape = cast(Escape, table.string("escape", allowed=get_args(Escape)))
    return Prevention(answer=answer, escape=escape, **seconds)


def _violation_lines(violation: Violation, worst: Worst | None) -> list[str]:
    # A comment ends at a line's end, so that no text may bring one.
    unit = printable(violation.unit, keep="")
    return [
        "[violation]",
        f"signature = {quoted(violation.signature)}",
        f'type = "{violation.type}"',
        f'property = "{violation.property}"',
        f"margin = {violation.margin!r}  # {unit}; what is not above 0 is violated",
        f"unit = {quoted(violation.unit)}",
        *_worst_lines(worst),
        f"story = {quoted(violation.description)}",
    ]


def _worst_lines(worst: Worst | None) -> list[str]:
    if worst is None:
        return []
    lines = [f"worst_margin = {worst.margin!r}  # of the search; a worse one is not excused"]
    return [*lines, *([f"weakest_grade = {quoted(worst.grade)}"] if worst.grade else [])]


def _read_worst(table: Table) -> Worst | None:
    if "worst_margin" not in table.values:
        if "weakest_grade" in table.values:
            raise table.error("weakest_grade", "found a grade, expected one beside worst_margin")
        return None
    known = "weakest_grade" in table.values
    return Worst(
        margin=table.number("worst_margin"),
        grade=table.string("weakest_grade", allowed=GRADES) if known else "",
    )


def _read_violation(table: Table) -> Violation:
    table.refuse_unknown(_VIOLATION_KEYS)
    return Violation(
        signature=table.string("signature"),
        type=cast(ViolationType, table.string("type", allowed=get_args(ViolationType))),
        property=cast(PropertyName, table.string("property", allowed=get_args(PropertyName))),
        margin=table.number("margin"),
        unit=table.string("unit"),
        description=table.string("story"),
    )


def _limits_lines(limits: Limits) -> list[str]:
    return [
        "[limits]",
        f"distance_m = {limits.distance_m!r}",
        f"time_s = {limits.time_s!r}",
        f'abort = "{limits.abort}"',
    ]


def read_limits(table: Table) -> Limits:
    """Return the limits in a table of their own."""
    table.refuse_unknown({"distance_m", "time_s", "abort"})
    abort = table.string("abort", allowed=("needless", "ok", "violation"))
    return Limits(
        distance_m=table.number("distance_m", low=0.0, high=FARTHEST_M),
        time_s=table.number("time_s", low=0.0, high=LONGEST_S),
        abort=cast(AbortRule, abort),
    )


def _policy_lines(case: Case) -> list[str]:
    return [
        "# Who moved the objects when this was found.",
        "[policy]",
        f"name = {quoted(case.policy)}",
        f"sha256 = {quoted(case.policy_sha256)}",
    ]


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
    return [
        [
            "[evidence]",
            f"trajectory_sha256 = {quoted(evidence.trajectory_sha256)}",
            f"cpu = {quoted(evidence.cpu)}  # class of CPUs on which the hash holds",
            # Files that were written when there was one engine only have no such line.
            *([] if evidence.engine == "bullet" else [f'engine = "{evidence.engine}"']),
            f"map_sha256 = {quoted(evidence.map_sha256)}",
            f"neighbours = {evidence.neighbours}  # slightly different scenarios flown",
            f"neighbours_failed = {evidence.neighbours_failed}",
            f"removed = {quoted(evidence.removed)}",
            f"system_sha256 = {quoted(evidence.system_sha256)}",
            f"simulator_sha256 = {quoted(evidence.simulator_sha256)}",
        ],
        [
            "[evidence.versions]",
            *(f"{quoted(name)} = {quoted(version)}" for name, version in evidence.versions),
        ],
    ]


def _read_evidence(table: Table) -> CaseEvidence:
    hashes = {"trajectory_sha256", "map_sha256", "system_sha256", "simulator_sha256"}
    others = {"cpu", "engine", "neighbours", "neighbours_failed", "removed", "versions"}
    table.refuse_unknown(hashes | others)
    versions = table.table("versions")
    return CaseEvidence(
        trajectory_sha256=table.string("trajectory_sha256"),
        cpu=table.string("cpu"),
        map_sha256=table.string("map_sha256"),
        neighbours=table.integer("neighbours"),
        neighbours_failed=table.integer("neighbours_failed"),
        removed=table.string("removed"),
        versions=tuple((name, versions.string(name)) for name in versions.values),
        system_sha256=table.string("system_sha256"),
        simulator_sha256=table.string("simulator_sha256"),
        engine=cast(Engine, table.string("engine", "bullet", allowed=get_args(Engine))),
    )


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


MOST_OBJECTS = 1000
FASTEST_MPS = 1000.0
"""More is no object of a map, and no speed of a body."""
_OF_BODY = {"grade", "type", "objects", "interference_s", "speed_mps", "when", "window_s"} | {
    "untried"
}
_OF_CONDITIONS = {"conditions", "values", "largest", "largest_share", "idle", "untried"} | {
    "placed"
}
_OF_SHRUNK = {
    "body": "# The adversary that it takes; the weaker, the worse.",
    "conditions": "# The conditions that it takes; the fewer, the worse.",
}
_PLACED = "placed = true  # the marker lies beside the map's coordinate"
_NOT_SHRUNK = "# Unusual in the flight that was found; the case is not shrunk."


def severity_lines(severity: Severity, *, is_shrunk: bool) -> list[list[str]]:
    """Return the section, in a list of one; an empty list for an empty severity."""
    untried = _names("untried", severity.untried)
    comment = _OF_SHRUNK.get(severity.about, "") if is_shrunk else _NOT_SHRUNK
    if severity.about == "body":
        window_s = severity.window_s
        return [
            [
                comment,
                "[severity]",
                *([f"grade = {quoted(severity.grade)}"] if severity.grade else []),
                f"type = {quoted(severity.type)}",
                f"objects = {severity.objects}",
                f"interference_s = {severity.interference_s!r}",
                f"speed_mps = {severity.speed_mps!r}",
                *([f"when = {quoted(severity.when)}"] if severity.when else []),
                *([] if window_s is None else [f"window_s = {window_s!r}  # of its entry"]),
                *untried,
            ]
        ]
    if severity.about == "conditions":
        names, values = (
            ", ".join(quoted(each) for each in texts)
            for texts in (severity.conditions, severity.values)
        )
        return [
            [
                comment,
                "[severity]",
                f"conditions = [{names}]",
                *([f"values = [{values}]"] if severity.values else []),
                f"largest = {quoted(severity.largest)}",
                f"largest_share = {severity.largest_share!r}",
                *_names("idle", severity.idle),
                *([_PLACED] if severity.placed else []),
                *untried,
            ]
        ]
    return []


def _names(key: str, names: tuple[str, ...]) -> list[str]:
    return [f"{key} = [{', '.join(quoted(each) for each in names)}]"] if names else []


def _read_names(table: Table, key: str) -> tuple[str, ...]:
    return tuple(table.strings(key)) if key in table.values else ()


def read_severity(top: Table) -> Severity:
    """Return the severity in a document, empty without one; raise ScenarioError for a wrong key."""
    if "severity" not in top.values:
        return NO_SEVERITY
    table = top.table("severity")
    if "conditions" in table.values:
        table.refuse_unknown(_OF_CONDITIONS)
        conditions = tuple(table.strings("conditions"))
        values = _read_names(table, "values")
        if len(values) != len(conditions):
            expected = f"one text for each of {len(conditions)} conditions"
            raise table.error("values", f"found {len(values)} texts, expected {expected}")
        return Severity(
            about="conditions",
            conditions=conditions,
            values=values,
            largest=table.string("largest"),
            largest_share=table.number("largest_share", low=0.0, high=1.0),
            idle=_read_names(table, "idle"),
            placed=table.boolean("placed", default=False),
            untried=_read_names(table, "untried"),
        )
    table.refuse_unknown(_OF_BODY)
    return Severity(
        about="body",
        grade=table.string("grade", allowed=GRADES) if "grade" in table.values else "",
        type=table.string("type"),
        objects=table.integer("objects", high=MOST_OBJECTS),
        interference_s=table.number("interference_s", low=0.0, high=LONGEST_S),
        speed_mps=table.number("speed_mps", low=0.0, high=FASTEST_MPS),
        when=table.string("when") if "when" in table.values else "",
        window_s=table.number("window_s", low=0.0, high=LONGEST_S)
        if "window_s" in table.values
        else None,
        untried=_read_names(table, "untried"),
    )
