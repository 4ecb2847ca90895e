"""Cases as small, sorted, commented TOML files: a person reads them, and no code is in them."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast

from pytest_garl.errors import ScenarioError
from pytest_garl.execution.reference import SYSTEM_NAME
from pytest_garl.files.reading import read_text
from pytest_garl.files.toml import Table, finite, parse
from pytest_garl.files.toml import quoted as _text
from pytest_garl.messages import shown
from pytest_garl.regressions.case import (
    Avoidable,
    Case,
    ChangeList,
    Changes,
    Evidence,
    MoveList,
    RecordedBehaviour,
    Status,
    Violation,
    own_test,
)
from pytest_garl.scenarios.files import gene_lines, read_genes
from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from pytest_garl.verdicts.verdict import (
    FARTHEST_M,
    LONGEST_S,
    Limits,
    PropertyName,
    ViolationType,
)

SCHEMA = 1
_TYPES = ("I", "II", "III", "IV", "V", "late", "off", "hard", "abort", "own")
_PROPERTIES = ("distance", "time", "collision", "crash", "abort", "own")
_STATUSES = ("open", "fixed", "unavoidable")
_AVOIDABLE = ("live", "recorded", "no")
_WIDTH = 98
_MOST_MOVES = round(LONGEST_S / DECISION_STEP_S)


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseHeader:
    """What of a case decides which items it becomes."""

    system: str
    status: Status
    avoidable: Avoidable
    map: str
    own_test: str


def dumps(case: Case) -> str:
    """Return the case as TOML: the same bytes for equal cases."""
    violation, evidence, scenario = case.violation, case.evidence, case.scenario
    description = "".join(char if char.isprintable() else " " for char in violation.description)
    lines = [f"# {line}" for line in textwrap.wrap(description, _WIDTH)]
    lines += [
        f"schema = {SCHEMA}",
        f"system = {_text(case.system)}",
        f'status = "{case.status}"',
        *(["accepted = true"] if case.accepted else []),
        f'avoidable = "{case.avoidable}"  # among which objects the reference pilot comes through',
        f"map = {_text(scenario.map)}",
        f"seed = {scenario.seed}",
    ]
    if case.test:
        lines.append(f"test = {_text(case.test)}")
    if case.assertion:
        lines.append(f"assertion = {_text(case.assertion)}")
    if scenario.removed_objects:
        lines.append(f"absent = [{', '.join(_text(name) for name in scenario.removed_objects)}]")
    lines += [
        "",
        "[violation]",
        f"signature = {_text(violation.signature)}",
        f'type = "{violation.type}"',
        f'property = "{violation.property}"',
        f"margin = {violation.margin!r}  # {violation.unit}; what is not above 0 is violated",
        f"unit = {_text(violation.unit)}",
        f"story = {_text(violation.description)}",
    ]
    lines += [
        "",
        "[limits]",
        f"distance_m = {case.limits.distance_m!r}",
        f"time_s = {case.limits.time_s!r}",
        f'abort = "{case.limits.abort}"',
        "",
        "# Weather from 0 to 1, places from -1 to 1, velocity as a share of the top speed.",
    ]
    lines += gene_lines(scenario)[1:]
    lines += [
        "",
        "# Who moved the objects when this was found.",
        "[policy]",
        f"name = {_text(case.policy)}",
        f"sha256 = {_text(case.policy_sha256)}",
        "",
        "# What they did: [times, x, y], each for half a second; x east and y north as shares of",
        "# the object's speed. After the last they leave the marker's surroundings.",
        "[moves]",
    ]
    lines += [f"{name} = {_moves(moves)}" for name, moves in case.moves]
    if case.changes:
        lines += [
            "",
            "# What their policies changed of the environment: [decision, gene, added to it], the",
            "# number of the decision from 0, two a second.",
            "[changes]",
            *(f"{name} = {_changes(own)}" for name, own in case.changes),
        ]
    lines += [
        "",
        "[evidence]",
        f'trajectory_sha256 = "{evidence.trajectory_sha256}"',
        f"cpu = {_text(evidence.cpu)}  # class of CPUs on which the hash holds",
        f'map_sha256 = "{evidence.map_sha256}"',
        f"neighbours = {evidence.neighbours}  # slightly different scenarios flown",
        f"neighbours_failed = {evidence.neighbours_failed}",
        f"removed = {_text(evidence.removed)}",
        *(
            f'{key} = "{value}"'
            for key, value in (
                ("system_sha256", evidence.system_sha256),
                ("simulator_sha256", evidence.simulator_sha256),
            )
            if value
        ),
        "",
        "[evidence.versions]",
        *(f"{_text(name)} = {_text(version)}" for name, version in evidence.versions),
    ]
    return "\n".join(lines) + "\n"


def size_of(case: Case) -> int:
    """Return how many characters the scenario and the record take in the file."""
    return sum(len(line) for line in (*gene_lines(case.scenario), *record_lines(case.behaviour)))


def record_lines(behaviour: RecordedBehaviour) -> list[str]:
    """Return the lines that hold what the objects did and what their policies changed."""
    lines = [f"{name} = {_moves(moves)}" for name, moves in behaviour.moves]
    return lines + [f"{name} = {_changes(own)}" for name, own in behaviour.changes]


def loads(text: str, load_map: Callable[[str], Map], *, source: str = "case") -> Case:
    """Return the case in ``text``; raise ScenarioError that names source and key."""
    top = Table(parse(text, source), source)
    top.only(
        {
            "schema",
            "system",
            "status",
            "accepted",
            "avoidable",
            "map",
            "seed",
            "test",
            "assertion",
            "absent",
            "violation",
            "limits",
            "genes",
            "policy",
            "moves",
            "changes",
            "evidence",
        }
    )
    head = _read_head(top)
    try:
        map = load_map(head.map)
    except ScenarioError as error:
        raise top.error("map", str(error)) from error
    scenario = read_genes(top, map)
    violation = top.table("violation")
    violation.only({"signature", "type", "property", "margin", "unit", "story"})
    policy = top.table("policy")
    policy.only({"name", "sha256"})
    return Case(
        system=head.system,
        status=head.status,
        avoidable=head.avoidable,
        scenario=scenario,
        violation=Violation(
            signature=violation.text("signature"),
            type=cast(ViolationType, violation.text("type", among=_TYPES)),
            property=cast(PropertyName, violation.text("property", among=_PROPERTIES)),
            margin=violation.number("margin"),
            unit=violation.text("unit"),
            description=violation.text("story"),
        ),
        policy=policy.text("name"),
        policy_sha256=policy.text("sha256"),
        moves=_read_moves(top.table("moves"), map, scenario.removed_objects),
        changes=_read_changes(top.table("changes"), map, scenario.removed_objects)
        if "changes" in top.values
        else (),
        evidence=_read_evidence(top.table("evidence")),
        limits=read_limits(top.table("limits")),
        test=top.text("test", ""),
        assertion=top.text("assertion", ""),
        accepted=top.truth("accepted", default=False),
    )


def load_header(path: Path) -> CaseHeader:
    """Return the keys above a file's first table, in a fraction of the time of all of it."""
    head, _, _ = read_text(path).partition("\n[")
    return _read_head(Table(parse(head, str(path)), str(path)))


def _read_head(top: Table) -> CaseHeader:
    if top.integer("schema") != SCHEMA:
        raise top.error("schema", f"found {shown(top.get('schema'))}, expected {SCHEMA}")
    system = top.text("system")
    if not SYSTEM_NAME.fullmatch(system):
        raise top.error(
            "system", f"found {shown(system)}, expected 'module:class', names with dots between"
        )
    return CaseHeader(
        system=system,
        status=cast(Status, top.text("status", among=_STATUSES)),
        avoidable=cast(Avoidable, top.text("avoidable", among=_AVOIDABLE)),
        map=top.text("map"),
        own_test=own_test(top.text("test", ""), top.text("assertion", "")),
    )


def load(path: Path, search_path: tuple[Path, ...] = ()) -> Case:
    """Return the case in a file."""
    from pytest_garl.scenarios.maps.map import load_map

    return loads(read_text(path), lambda name: load_map(name, search_path), source=str(path))


def read_limits(table: Table) -> Limits:
    """Return the limits in a table of their own."""
    table.only({"distance_m", "time_s", "abort"})
    abort = table.text("abort", among=("ok", "violation"))
    return Limits(
        distance_m=table.number("distance_m", low=0.0, high=FARTHEST_M),
        time_s=table.number("time_s", low=0.0, high=LONGEST_S),
        abort=cast(Literal["ok", "violation"], abort),
    )


def _read_moves(table: Table, map: Map, removed: Sequence[str]) -> tuple[tuple[str, MoveList], ...]:
    names = [name for name, _ in map.all_objects if name not in removed]
    table.only(names)
    return tuple((name, _read_runs(table, name)) for name in names)


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
        if len(moves) + times > _MOST_MOVES:
            raise table.error(
                name,
                f"found {shown(run)} after {len(moves)} moves, expected at most {_MOST_MOVES} "
                f"moves in all: no flight is longer than {LONGEST_S:g} s",
            )
        moves += [(x, y)] * times
    return tuple(moves)


def _read_changes(table: Table, map: Map, removed: Sequence[str]) -> Changes:
    names = [name for name, _ in map.all_objects if name not in removed]
    table.only(names)
    expected = f"expected a list of [decision, gene, number] with one of {', '.join(ENVIRONMENT)}"
    found = []
    for name in (each for each in names if each in table.values):
        rows = table.get(name)
        if not isinstance(rows, list):
            raise table.error(name, f"found {shown(rows)}, {expected}")
        wrong = next((row for row in rows if not _is_change(row)), None)
        if wrong is not None:
            raise table.error(name, f"found {shown(wrong)}, {expected}")
        found.append((name, tuple((row[0], row[1], float(row[2])) for row in rows)))
    return tuple(found)


def _is_change(row: object) -> bool:
    if not isinstance(row, list) or [type(item) for item in row[:2]] != [int, str]:
        return False
    return (
        len(row) == 3
        and 0 <= row[0] < _MOST_MOVES
        and row[1] in ENVIRONMENT
        and finite(row[2]) is not None
    )


def _read_evidence(table: Table) -> Evidence:
    table.only(
        {
            "trajectory_sha256",
            "cpu",
            "map_sha256",
            "neighbours",
            "neighbours_failed",
            "removed",
            "system_sha256",
            "simulator_sha256",
            "versions",
        }
    )
    versions = table.table("versions")
    return Evidence(
        trajectory_sha256=table.text("trajectory_sha256"),
        cpu=table.text("cpu"),
        map_sha256=table.text("map_sha256"),
        neighbours=table.integer("neighbours"),
        neighbours_failed=table.integer("neighbours_failed"),
        removed=table.text("removed"),
        versions=tuple((name, versions.text(name)) for name in versions.values),
        system_sha256=table.text("system_sha256", ""),
        simulator_sha256=table.text("simulator_sha256", ""),
    )


def _changes(changes: ChangeList) -> str:
    rows = (f"[{decision}, {_text(key)}, {by!r}]" for decision, key, by in changes)
    return f"[{', '.join(rows)}]"


def _moves(moves: MoveList) -> str:
    # By what is written: -0.0 equals 0.0 and is another number.
    runs = [
        (len(list(run)), text) for text, run in itertools.groupby(f"{x!r}, {y!r}" for x, y in moves)
    ]
    return f"[{', '.join(f'[{count}, {text}]' for count, text in runs)}]"
