"""Baselines: scenarios and the results of their flights, as one TOML file without code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.cases.case_file import read_limits
from pytest_garl.engine import Engine, engine_of
from pytest_garl.errors import BaselineError, GarlError, ScenarioError
from pytest_garl.files.atomic import write_text_atomically
from pytest_garl.files.user_files import MEGABYTE, Table, parse_table, quoted, read_text
from pytest_garl.gate.pairs import FlightSummary
from pytest_garl.gate.rows import RowReader, is_sparse, listed_genes, row_text
from pytest_garl.messages import shown
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Task, read_task, task_lines
from pytest_garl.verdicts.verdict import Limits

SCHEMA = 2
LARGEST_BYTES = 4 * MEGABYTE
"""About six thousand flights, each a line of 600 bytes.  Reading TOML takes up to a hundred times
as much memory."""
_KEYS = {
    "system",
    "map",
    "map_sha256",
    "simulator",
    "npcs",
    "npcs_sha256",
    "method",
    "limits",
    "genes",
    "sparse",
    "task",
    "flights",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class BaselineFlight:
    """One scenario and the summary of its flight."""

    scenario: Scenario
    summary: FlightSummary


@dataclass(frozen=True, slots=True, kw_only=True)
class BaselineSet:
    """Flights of one landing system on one map, and the conditions of these flights.

    ``system`` and ``simulator`` are "module:name".  ``npcs`` is the NPC policy, ``npcs_sha256`` the
    hash of a learned policy's weights and else empty.  ``method`` is the search method that chose
    the scenarios; it is empty if that is not known.
    """

    system: str
    map: str
    map_sha256: str
    simulator: str
    npcs: str
    npcs_sha256: str
    limits: Limits
    flights: tuple[BaselineFlight, ...]
    method: str = ""

    @property
    def title(self) -> str:
        """Name for people and item ids, such as ``Lander-court``."""
        return f"{self.system.rpartition(':')[2]}-{self.map}"

    @property
    def warning(self) -> str:
        """A warning for comparisons with this set; empty if there is none."""
        if self.method in ("", "random"):
            return ""
        return (
            f"the search method {self.method!r} chose these scenarios where the landing system "
            "failed; some failed by chance, so this baseline is kinder to a change than random "
            "scenarios are"
        )

    @property
    def task(self) -> Task:
        """The task that all its flights have."""
        return self.flights[0].scenario.task

    def scenario_name(self, index: int) -> str:
        """Return a scenario's name, such as ``court-17``."""
        return f"{self.map}-{index}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Baseline:
    """Sets of one or more systems and maps; the hashes are valid on CPUs of the class ``cpu``."""

    cpu: str
    versions: tuple[tuple[str, str], ...]
    sets: tuple[BaselineSet, ...]

    @property
    def engine(self) -> Engine:
        """The physics engine that flew it."""
        return engine_of(self.versions) or "bullet"

    def find(self, system: str, map: str) -> BaselineSet | None:
        """Return the set of a system on a map, if there is one."""
        found = (each for each in self.sets if (each.system, each.map) == (system, map))
        return next(found, None)


def dump_baseline(baseline: Baseline) -> str:
    """Return the baseline as TOML: the same bytes for equal baselines."""
    lines = [
        "# A baseline of pytest-garl: scenarios, and what a landing system made of them.",
        "# Fly them again on a changed system: pytest --garl-baseline=THIS_FILE",
        f"schema = {SCHEMA}",
        f"cpu = {quoted(baseline.cpu)}  # class of CPUs on which the hashes hold",
        "",
        "[versions]",
        *(f"{quoted(name)} = {quoted(version)}" for name, version in baseline.versions),
    ]
    for each in baseline.sets:
        lines += ["", *_set_lines(each)]
    return "\n".join(lines) + "\n"


def _set_lines(each: BaselineSet) -> list[str]:
    limits = each.limits
    sparse = is_sparse(flight.scenario for flight in each.flights)
    keys = listed_genes(each.flights[0].scenario, sparse)
    return [
        "[[set]]",
        f"system = {quoted(each.system)}",
        f"map = {quoted(each.map)}",
        f"map_sha256 = {quoted(each.map_sha256)}",
        f"simulator = {quoted(each.simulator)}",
        f"npcs = {quoted(each.npcs)}",
        f"npcs_sha256 = {quoted(each.npcs_sha256)}",
        f"method = {quoted(each.method)}  # which chose the scenarios",
        f"limits = {{ distance_m = {limits.distance_m!r}, time_s = {limits.time_s!r}, "
        f'abort = "{limits.abort}" }}',
        f"genes = [{', '.join(quoted(key) for key in keys)}]",
        *(["sparse = true  # a flight ends with further genes; other objects are absent"] * sparse),
        "# Each: seed, outcome, signature, violation as the paper defines it, why it did not land",
        "# (blocked, excused or needless), [distance in m, time in s] of the landing, SHA-256 of",
        "# the trajectory, values of the genes" + (", further ones." if sparse else "."),
        "flights = [",
        *(
            f"  {row_text(flight.scenario, flight.summary, keys, sparse)},"
            for flight in each.flights
        ),
        "]",
        *task_lines(each.task, "set."),
    ]


def parse_baseline(
    text: str, load_map: Callable[[str], Map], *, source: str = "baseline"
) -> Baseline:
    """Return the baseline in ``text``; raise ScenarioError that names source and key."""
    top = parse_table(text, source)
    top.refuse_unknown({"schema", "cpu", "versions", "set"})
    if top.integer("schema") != SCHEMA:
        raise top.error("schema", f"found {shown(top.get('schema'))}, expected {SCHEMA}")
    versions = top.table("versions")
    baseline = Baseline(
        cpu=top.string("cpu"),
        versions=tuple((name, versions.string(name)) for name in versions.values),
        sets=tuple(_read_set(table, load_map) for table in top.tables("set")),
    )
    _check(baseline, lambda problem: top.error("set", problem))
    return baseline


def load_baseline(path: Path, search_path: tuple[Path, ...] = ()) -> Baseline:
    """Return the baseline in a file."""
    from pytest_garl.scenarios.maps.loading import load_map

    hint = "; expected a file that `garl baseline save` wrote"
    text = read_text(path, LARGEST_BYTES, hint=hint)
    return parse_baseline(text, lambda name: load_map(name, search_path), source=str(path))


def save_baseline(path: Path, baseline: Baseline) -> None:
    """Write the file atomically; an existing one is replaced.

    Raises BaselineError for a baseline that could not be read again, as one that is too large.
    """
    _check(baseline, lambda problem: BaselineError(f"{path}: {problem}"))
    text = dump_baseline(baseline)
    if len(text.encode()) > LARGEST_BYTES:
        flights = sum(len(each.flights) for each in baseline.sets)
        raise BaselineError(
            f"{path}: found {flights} flights in {len(text.encode())} bytes, expected at most "
            f"{LARGEST_BYTES}; save fewer flights"
        )
    write_text_atomically(path, text)


def _check(baseline: Baseline, error: Callable[[str], GarlError]) -> None:
    """Raise the error that ``error`` makes of a message if sets or flights do not fit together."""
    if not baseline.sets:
        raise error("found none, expected at least one [[set]]")
    places = [(each.system, each.map) for each in baseline.sets]
    twice = next((place for place in places if places.count(place) > 1), None)
    if twice:
        raise error(f"found {twice[0]} on {twice[1]} twice, expected one set of each")
    for each in baseline.sets:
        if not each.flights:
            raise error(f"{each.system} on {each.map}: found no flights, expected at least one")
        if any(flight.scenario.task != each.task for flight in each.flights):
            raise error(
                f"{each.system} on {each.map}: found flights to different markers, or from "
                "different starts, expected the same task for all flights of a set"
            )


def _read_set(table: Table, load_map: Callable[[str], Map]) -> BaselineSet:
    table.refuse_unknown(_KEYS)
    for key in ("system", "simulator"):
        if not all(table.string(key).partition(":")):
            raise table.error(key, f"found {shown(table.string(key))}, expected 'module:name'")
    try:
        map = load_map(table.string("map"))
    except ScenarioError as error:
        raise table.error("map", str(error)) from error
    reader = RowReader(table=table, map=map, keys=table.strings("genes"), task=read_task(table))
    rows = table.get("flights")
    if not isinstance(rows, list):
        raise table.error("flights", f"found {shown(rows)}, expected a list of flights")
    return BaselineSet(
        system=table.string("system"),
        map=map.name,
        map_sha256=table.string("map_sha256"),
        simulator=table.string("simulator"),
        npcs=table.string("npcs"),
        npcs_sha256=table.string("npcs_sha256"),
        method=table.string("method"),
        limits=read_limits(table.table("limits")),
        flights=tuple(_flight(reader, f"flights[{index}]", row) for index, row in enumerate(rows)),
    )


def _flight(reader: RowReader, key: str, row: Any) -> BaselineFlight:
    scenario, summary = reader.read(key, row)
    return BaselineFlight(scenario=scenario, summary=summary)
