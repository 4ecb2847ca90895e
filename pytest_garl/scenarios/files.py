"""Scenarios as text: TOML files for people, one line of JSON in a ledger."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

from pytest_garl.errors import ScenarioError
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.files.reading import read_text
from pytest_garl.files.toml import Table, parse, quoted
from pytest_garl.messages import shown
from pytest_garl.scenarios.genes import genome_like
from pytest_garl.scenarios.groups.catalogue import GROUPS, PARAMETERS
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Task, read_task, task_lines

SCHEMA = 1


def dumps(scenario: Scenario) -> str:
    """Return the scenario as TOML: the same bytes for equal scenarios."""
    lines = [
        "# A scenario of pytest-garl. Genes are without unit: weather 0 to 1, places -1 to 1,",
        "# velocity as a share of the type's top speed; others have their unit in their name.",
        f"schema = {SCHEMA}",
        f"map = {quoted(scenario.map)}",
        f"seed = {scenario.seed}",
    ]
    if scenario.removed_objects:
        names = ", ".join(quoted(name) for name in scenario.removed_objects)
        lines.append(f"absent = [{names}]")
    return "\n".join([*lines, *task_lines(scenario.task), *gene_lines(scenario)]) + "\n"


def gene_lines(scenario: Scenario) -> list[str]:
    """Return the lines of a file that hold the genes, one table per subject.

    A condition with its nominal value has no line.
    """
    lines, section = [], ""
    for key, value in scenario.genes:
        if key in PARAMETERS and value == PARAMETERS[key].nominal:
            continue
        head, _, name = key.partition(".")
        if head != section:
            lines += ["", f"[genes.{head}]"]
            section = head
        lines.append(f"{name} = {value!r}")
    return lines


def loads(text: str, map: Map, *, source: str = "scenario") -> Scenario:
    """Return the scenario in ``text``, which must name exactly the genes of its map.

    Weather may use the full range.  Raises ScenarioError that names source and key.
    """
    top = Table(parse(text, source), source)
    top.refuse_unknown({"schema", "map", "seed", "absent", "genes", "task"})
    if top.integer("schema") != SCHEMA:
        raise top.error("schema", f"found {shown(top.get('schema'))}, expected {SCHEMA}")
    if top.string("map") != map.name:
        raise top.error("map", f"found {shown(top.string('map'))}, expected {map.name!r}")
    return read_genes(top, map)


def read_genes(top: Table, map: Map) -> Scenario:
    """Return the scenario in a document's ``seed``, ``absent``, ``genes`` and ``task``."""
    removed = top.strings("absent")
    try:
        map = map.without(removed)
    except ScenarioError as error:
        raise top.error("absent", str(error)) from error
    sections = top.table("genes")
    named = (
        f"{head}.{name}"
        for head, section in sections.values.items()
        for name in (section if isinstance(section, dict) else ())
    )
    genome = genome_like(named, map)
    heads = {key.partition(".")[0] for key in genome.keys}
    sections.refuse_unknown(heads)
    tables = {head: sections.table(head) for head in heads}
    for head, table in tables.items():
        table.refuse_unknown(
            {key.partition(".")[2] for key in genome.keys if key.startswith(f"{head}.")}
        )
    genes = []
    for item in genome.properties:
        head, _, name = item.key.partition(".")
        if head in GROUPS and name not in tables[head].values:
            continue
        genes.append((item.key, tables[head].number(name, low=item.low, high=item.high)))
    seed = top.integer("seed")
    return Scenario(
        map=map.name,
        seed=seed,
        genes=tuple(genes),
        removed_objects=map.removed_objects,
        task=read_task(top),
    )


def map_name_in(text: str, *, source: str = "scenario") -> str:
    """Return the name of the map that a scenario file wants."""
    return Table(parse(text, source), source).string("map")


def load(path: Path, search_path: tuple[Path, ...] = ()) -> Scenario:
    """Return the scenario in a file."""
    from pytest_garl.scenarios.maps.map import load_map

    text = read_text(path)
    map = load_map(map_name_in(text, source=str(path)), search_path)
    return loads(text, map, source=str(path))


def dump_scenario(scenario: Scenario) -> str:
    """Return a scenario as one line of JSON."""
    values: dict[str, object] = {
        "map": scenario.map,
        "seed": scenario.seed,
        "genes": scenario.genes,
    }
    if scenario.removed_objects:
        values["absent"] = scenario.removed_objects
    if scenario.task != Task():
        values["task"] = dataclasses.asdict(scenario.task)
    return json.dumps(values)


def parse_scenario(text: str) -> Scenario:
    """Return the scenario in a line of JSON; raise ScenarioError for a damaged one."""
    try:
        values = parse_json(text)
        if isinstance(values, dict):
            values["removed_objects"] = values.pop("absent", [])
            values.setdefault("task", dataclasses.asdict(Task()))
        scenario = dataclass_from(Scenario, values)
    except ValueError as error:
        raise ScenarioError(f"a stored scenario is damaged: {error}") from error
    genes = tuple((key, float(value)) for key, value in scenario.genes)
    return dataclasses.replace(scenario, genes=genes)
