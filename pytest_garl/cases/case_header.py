"""The facts above the first table of a case file: schema, status, what gates, system, map, test."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import cast, get_args

from pytest_garl.cases.case import Case, NoGateReason, Status, asserting_test
from pytest_garl.execution.reference import SYSTEM_NAME
from pytest_garl.files.user_files import Table, parse_table, quoted, read_text
from pytest_garl.messages import shown
from pytest_garl.scenarios.files import absent_line
from pytest_garl.scenarios.maps.map import Map

SCHEMA = 2
HEADER_KEYS = frozenset(
    {"schema", "system", "status", "accepted", "gates", "reason", "live", "map", "seed", "test"}
    | {"assertion"}
)
"""Keys that may stand above the first table."""
_WIDTH = 98


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseHeader:
    """The facts above a file's first table, which decide the items that fly the case."""

    system: str
    status: Status
    live: bool
    reason: NoGateReason
    map: str
    test: str
    asserting_test: str


def header_lines(case: Case, map: Map) -> list[str]:
    """Return the lines above the first table."""
    text, scenario = case.violation.description, case.scenario
    description = "".join(char if char.isprintable() else " " for char in text)
    lines = [
        *(f"# {line}" for line in textwrap.wrap(description, _WIDTH)),
        f"schema = {SCHEMA}",
        f"system = {quoted(case.system)}",
        f'status = "{case.status}"',
        *(["accepted = true"] if case.accepted else []),
        *([] if case.gates else ["gates = false", f'reason = "{case.reason}"']),
        *(["live = true  # a repair must hold against a live policy too"] if case.live else []),
        f"map = {quoted(scenario.map)}",
        f"seed = {scenario.seed}",
    ]
    if case.test:
        lines.append(f"test = {quoted(case.test)}")
    if case.assertion:
        lines.append(f"assertion = {quoted(case.assertion)}")
    return [*lines, *absent_line(scenario, map)]


def load_header(path: Path) -> CaseHeader:
    """Return the facts above a file's first table, in a fraction of the time of the whole case."""
    text, _, _ = read_text(path).partition("\n[")
    top = parse_table(text, str(path))
    return read_header(top)


def read_header(top: Table) -> CaseHeader:
    """Return the header; raise ScenarioError that names the key."""
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
        live=top.boolean("live", default=False),
        reason=_read_reason(top),
        map=top.string("map"),
        test=top.string("test", ""),
        asserting_test=asserting_test(top.string("test", ""), top.string("assertion", "")),
    )


def _read_reason(top: Table) -> NoGateReason:
    if top.boolean("gates", default=True):
        if "reason" in top.values:
            raise top.error("reason", "found a reason, expected one only beside 'gates = false'")
        return ""
    return cast(NoGateReason, top.string("reason", allowed=get_args(NoGateReason)[1:]))
