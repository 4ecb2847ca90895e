"""Scenarios as text: TOML files for people, one line of JSON in a ledger."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

from pytest_garl.errors import ScenarioError
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.files.user_files import Table, parse_table, quoted, read_text
from pytest_garl.messages import shown
from pytest_garl.scenarios.genome_like import genome_like
from pytest_garl.scenarios.groups import GROUPS, QUANTITIES
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY
from pytest_garl.scenarios.task import Task, read_task, task_lines
from pytest_garl.scenarios.units import HEIGHT, from_sections, ranges_of, sections_of, snapped

SCHEMA = 2


def dumps(scenario: Scenario, map: Map) -> str:
    """Return the scenario as TOML: the same bytes for equal scenarios."""
    lines = [
        "# A scenario of pytest-garl: the marker, the objects that are there, and what is not",
        "# nominal.  Each name ends with its unit; x is east and y north of the map's centre.",
        f"schema = {SCHEMA}",
        f"map = {quoted(scenario.map)}",
        f"seed = {scenario.seed}",
        *absent_line(scenario, map),
    ]
    return "\n".join([*lines, *scenario_lines(scenario, map), *task_lines(scenario.task)]) + "\n"


def absent_line(scenario: Scenario, map: Map) -> list[str]:
    """Return the line that names the removed objects; files in units need none."""
    if not scenario.removed_objects or is_in_units(scenario, map):
        return []
    names = ", ".join(quoted(name) for name in scenario.removed_objects)
    return [f"absent = [{names}]"]


def is_in_units(scenario: Scenario, map: Map) -> bool:
    """Return whether a file in physical units has exactly the scenario's values.

    A search method of a user's own may give genes of any number of digits.  Their file states them
    without unit, under ``genes``, so that it flies to the byte as the search did.
    """
    return snapped(scenario, map) == scenario


def scenario_lines(scenario: Scenario, map: Map) -> list[str]:
    """Return the lines of a file that hold the scenario's values, one table per subject."""
    if not is_in_units(scenario, map):
        return _gene_lines(scenario)
    lines = []
    for head, values in sections_of(scenario, map).items():
        lines += ["", f"[scenario.{head}]"]
        lines += [f"{name} = {_written(f'{head}.{name}', value)}" for name, value in values.items()]
    return lines


def _written(key: str, value: float) -> str:
    """Return a value in TOML: the name of a choice, or the number."""
    if key in QUANTITIES and QUANTITIES[key].choices:
        return quoted(QUANTITIES[key].text_of(value))
    told = STORY.get(key.partition(".")[2])
    choices = told.quantity.choices if told else ()
    return quoted(choices[int(value)]) if choices else repr(value)


def _gene_lines(scenario: Scenario) -> list[str]:
    lines, section = [], ""
    for key, value in scenario.genes:
        head, _, name = key.partition(".")
        if head != section:
            lines += ["", f"[genes.{head}]"]
            section = head
        lines.append(f"{name} = {value!r}")
    return lines


def loads(text: str, map: Map, *, source: str = "scenario") -> Scenario:
    """Return the scenario in ``text``; raise ScenarioError that names source and key."""
    top = parse_table(text, source)
    top.refuse_unknown({"schema", "map", "seed", *SCENARIO_KEYS})
    if top.integer("schema") != SCHEMA:
        raise top.error("schema", f"found {shown(top.get('schema'))}, expected {SCHEMA}")
    if top.string("map") != map.name:
        raise top.error("map", f"found {shown(top.string('map'))}, expected {map.name!r}")
    return read_scenario(top, map)


SCENARIO_KEYS = ("absent", "genes", "scenario", "task")
"""Keys of a document that :func:`read_scenario` reads."""


def read_scenario(top: Table, map: Map) -> Scenario:
    """Return the scenario in a document's ``scenario``, or in its ``genes`` and ``absent``.

    Raises ScenarioError that names source and key.
    """
    if "genes" in top.values and "scenario" in top.values:
        raise top.error("genes", "found tables 'genes' and 'scenario', expected one of them")
    if "genes" in top.values:
        return _read_genes(top, map)
    sections = top.table("scenario")
    objects = dict(map.all_objects)
    sections.refuse_unknown({"weather", "light", "marker", *objects, *GROUPS})
    present = [name for name in objects if name in sections.values]
    like = Scenario(
        map=map.name,
        seed=top.integer("seed"),
        genes=(),
        removed_objects=tuple(sorted({*objects} - {*present})),
        task=read_task(top),
    )
    values = {head: _read_section(sections.table(head), head, map) for head in sections.values}
    if "marker" not in values:
        raise sections.error("marker", "missing, expected the marker's place, x_m and y_m")
    scenario = from_sections(values, like, map)
    if not is_in_units(scenario, map):
        # More digits than a file keeps, or a place beyond the ends of its range.
        scenario = snapped(scenario, map)
    return scenario


def _read_section(table: Table, head: str, map: Map) -> dict[str, float]:
    ranges = ranges_of(head, map)
    optional = {name for name in ranges if name.startswith("destination_")}
    table.refuse_unknown({*ranges})
    if head not in ("weather", *GROUPS):
        for name in ranges:
            if name not in {*optional, HEIGHT, *STORY}:
                table.get(name)
    if bool(optional & {*table.values}) and not optional <= {*table.values}:
        table.get(next(iter(sorted(optional - {*table.values}))))
    if head in dict(map.all_objects) and {*table.values} & {*STORY}:
        table.get("grade")
    return {
        name: _number(table, head, name, low, high)
        for name, (low, high) in ranges.items()
        if name in table.values
    }


def _number(table: Table, head: str, name: str, low: float, high: float) -> float:
    quantity = QUANTITIES.get(f"{head}.{name}")
    if quantity is None and name in STORY:
        quantity = STORY[name].quantity
    if quantity and quantity.choices:
        return table.choice(name, quantity.choices)
    return table.number(name, low=low, high=high)


def _read_genes(top: Table, map: Map) -> Scenario:
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
        genes.append((item.key, _number(tables[head], head, name, item.low, item.high)))
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
    return parse_table(text, source).string("map")


def load(path: Path, search_path: tuple[Path, ...] = ()) -> Scenario:
    """Return the scenario in a file."""
    from pytest_garl.scenarios.maps.loading import load_map

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
