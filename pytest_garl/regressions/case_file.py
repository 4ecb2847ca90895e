"""Case files: small, sorted, commented TOML that a person can read, without any code.

The sections stand in the file in the order of the functions here.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast, get_args

from pytest_garl.errors import ScenarioError
from pytest_garl.execution.reference import SYSTEM_NAME
from pytest_garl.files.reading import read_text
from pytest_garl.files.toml import Table, parse, quoted
from pytest_garl.messages import shown
from pytest_garl.regressions.behaviour_toml import (
    change_lines,
    move_lines,
    read_changes,
    read_moves,
)
from pytest_garl.regressions.case import (
    Avoidable,
    Case,
    Evidence,
    Status,
    Violation,
    asserting_test,
)
from pytest_garl.scenarios.files import gene_lines, read_genes
from pytest_garl.scenarios.maps.map import Map, load_map
from pytest_garl.verdicts.verdict import (
    FARTHEST_M,
    LONGEST_S,
    AbortRule,
    Limits,
    PropertyName,
    ViolationType,
)

SCHEMA = 1
_WIDTH = 98
_HEADER_KEYS = {"schema", "system", "status", "accepted", "avoidable", "map", "seed", "test"}
_KEYS = _HEADER_KEYS | {"assertion", "absent"}
_SECTIONS = {"violation", "limits", "genes", "policy", "moves", "changes", "evidence"}


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseHeader:
    """The facts above a file's first table, which decide the items that fly the case."""

    system: str
    status: Status
    avoidable: Avoidable
    map: str
    asserting_test: str


def load_case(path: Path, map_folders: tuple[Path, ...] = ()) -> Case:
    """Return the case in a file; raise ScenarioError that names file and key."""
    return parse_case(read_text(path), lambda name: load_map(name, map_folders), source=str(path))


def load_header(path: Path) -> CaseHeader:
    """Return the facts above a file's first table, in a fraction of the time of the whole case."""
    header, _, _ = read_text(path).partition("\n[")
    return _read_header(Table(parse(header, str(path)), str(path)))


def dump_case(case: Case) -> str:
    """Return the case as TOML: the same bytes for equal cases."""
    sections = [
        _header_lines(case),
        _violation_lines(case.violation),
        _limits_lines(case.limits),
        [
            "# Weather from 0 to 1, places from -1 to 1, velocity as a share of the top speed.",
            *gene_lines(case.scenario)[1:],
        ],
        _policy_lines(case),
        *_behaviour_lines(case),
        *_evidence_lines(case.evidence),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections) + "\n"


def parse_case(text: str, load_map: Callable[[str], Map], *, source: str = "case") -> Case:
    """Return the case in ``text``; raise ScenarioError that names source and key."""
    top = Table(parse(text, source), source)
    top.refuse_unknown(_KEYS | _SECTIONS)
    header = _read_header(top)
    try:
        map = load_map(header.map)
    except ScenarioError as error:
        raise top.error("map", str(error)) from error
    scenario = read_genes(top, map)
    removed = scenario.removed_objects
    names = [name for name, _ in map.all_objects if name not in removed]
    policy = top.table("policy")
    policy.refuse_unknown({"name", "sha256"})
    return Case(
        system=header.system,
        status=header.status,
        avoidable=header.avoidable,
        scenario=scenario,
        violation=_read_violation(top.table("violation")),
        policy=policy.string("name"),
        policy_sha256=policy.string("sha256"),
        moves=read_moves(top.table("moves"), names),
        changes=read_changes(top.table("changes"), names) if "changes" in top.values else (),
        evidence=_read_evidence(top.table("evidence")),
        limits=read_limits(top.table("limits")),
        test=top.string("test", ""),
        assertion=top.string("assertion", ""),
        accepted=top.boolean("accepted", default=False),
    )


def record_lines(case: Case) -> list[str]:
    """Return the lines that hold the moves of the objects and their policies' changes."""
    return [*move_lines(case.behaviour), *change_lines(case.behaviour)]


def size_of(case: Case) -> int:
    """Return how many characters the scenario and the recorded behaviour take in the file."""
    return sum(len(line) for line in (*gene_lines(case.scenario), *record_lines(case)))


def _header_lines(case: Case) -> list[str]:
    text, scenario = case.violation.description, case.scenario
    description = "".join(char if char.isprintable() else " " for char in text)
    lines = [
        *(f"# {line}" for line in textwrap.wrap(description, _WIDTH)),
        f"schema = {SCHEMA}",
        f"system = {quoted(case.system)}",
        f'status = "{case.status}"',
        *(["accepted = true"] if case.accepted else []),
        f'avoidable = "{case.avoidable}"  # among which objects the reference pilot comes through',
        f"map = {quoted(scenario.map)}",
        f"seed = {scenario.seed}",
    ]
    if case.test:
        lines.append(f"test = {quoted(case.test)}")
    if case.assertion:
        lines.append(f"assertion = {quoted(case.assertion)}")
    if scenario.removed_objects:
        names = ", ".join(quoted(name) for name in scenario.removed_objects)
        lines.append(f"absent = [{names}]")
    return lines


def _read_header(top: Table) -> CaseHeader:
    if top.integer("schema") != SCHEMA:
        raise top.error("schema", f"found {shown(top.get('schema'))}, expected {SCHEMA}")
    system = top.string("system")
    if not SYSTEM_NAME.fullmatch(system):
        raise top.error(
            "system", f"found {shown(system)}, expected 'module:class', names with dots between"
        )
    return CaseHeader(
        system=system,
        status=cast(Status, top.string("status", allowed=get_args(Status))),
        avoidable=cast(Avoidable, top.string("avoidable", allowed=get_args(Avoidable))),
        map=top.string("map"),
        asserting_test=asserting_test(top.string("test", ""), top.string("assertion", "")),
    )


def _violation_lines(violation: Violation) -> list[str]:
    return [
        "[violation]",
        f"signature = {quoted(violation.signature)}",
        f'type = "{violation.type}"',
        f'property = "{violation.property}"',
        f"margin = {violation.margin!r}  # {violation.unit}; what is not above 0 is violated",
        f"unit = {quoted(violation.unit)}",
        f"story = {quoted(violation.description)}",
    ]


def _read_violation(table: Table) -> Violation:
    table.refuse_unknown({"signature", "type", "property", "margin", "unit", "story"})
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


def _evidence_lines(evidence: Evidence) -> list[list[str]]:
    sources = {
        "system_sha256": evidence.system_sha256,
        "simulator_sha256": evidence.simulator_sha256,
    }
    return [
        [
            "[evidence]",
            f'trajectory_sha256 = "{evidence.trajectory_sha256}"',
            f"cpu = {quoted(evidence.cpu)}  # class of CPUs on which the hash holds",
            f'map_sha256 = "{evidence.map_sha256}"',
            f"neighbours = {evidence.neighbours}  # slightly different scenarios flown",
            f"neighbours_failed = {evidence.neighbours_failed}",
            f"removed = {quoted(evidence.removed)}",
            *(f'{key} = "{value}"' for key, value in sources.items() if value),
        ],
        [
            "[evidence.versions]",
            *(f"{quoted(name)} = {quoted(version)}" for name, version in evidence.versions),
        ],
    ]


def _read_evidence(table: Table) -> Evidence:
    hashes = {"trajectory_sha256", "map_sha256", "system_sha256", "simulator_sha256"}
    table.refuse_unknown(hashes | {"cpu", "neighbours", "neighbours_failed", "removed", "versions"})
    versions = table.table("versions")
    return Evidence(
        trajectory_sha256=table.string("trajectory_sha256"),
        cpu=table.string("cpu"),
        map_sha256=table.string("map_sha256"),
        neighbours=table.integer("neighbours"),
        neighbours_failed=table.integer("neighbours_failed"),
        removed=table.string("removed"),
        versions=tuple((name, versions.string(name)) for name in versions.values),
        system_sha256=table.string("system_sha256", ""),
        simulator_sha256=table.string("simulator_sha256", ""),
    )
