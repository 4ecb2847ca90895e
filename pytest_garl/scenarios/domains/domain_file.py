"""Reads domains: those that are built in, by name, and files of users.

Every error names the file, the key and what was expected.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast, get_args

from pytest_garl.errors import ScenarioError
from pytest_garl.files.user_files import Table, parse_table, read_text
from pytest_garl.messages import listed, shown
from pytest_garl.scenarios.domains.domain import ABSENT, BIRD_HEIGHT, CONDITIONS, ELEVATION, Domain
from pytest_garl.scenarios.domains.names import BUILT_IN
from pytest_garl.scenarios.genes import WeatherRange
from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.scenarios.light import NOON_DEG

_SECTIONS = ("weather", "light", *GROUPS, "npcs")


def domain_named(text: str, folder: Path | None = None) -> Domain:
    """Return a built-in domain by its name, or that of a TOML file, relative to ``folder``.

    Raises ScenarioError that names the file and the key.
    """
    return _named(text, folder or Path(), ())


def _named(text: str, folder: Path, above: tuple[str, ...]) -> Domain:
    if text in BUILT_IN:
        return _read(Path(__file__).parent / f"{text}.toml", f"domain {text!r}", text, above)
    if not text.endswith(".toml"):
        raise ScenarioError(
            f"domain: found {shown(text)}, expected {listed(BUILT_IN)}, or a file that ends with "
            "'.toml'"
        )
    file = folder / text
    return _read(file, str(file), file.stem, above)


def _read(file: Path, source: str, name: str, above: tuple[str, ...]) -> Domain:
    place = str(file.resolve())
    if place in above:
        raise ScenarioError(f"{source}: key 'extends': found a circle of files, expected an end")
    text = read_text(file)
    top = parse_table(text, source)
    top.refuse_unknown({"extends", "npc_behaviour", "paper", *_SECTIONS})
    base: Domain | None = None
    if "extends" in top.values:
        try:
            base = _named(top.string("extends"), file.parent, (*above, place))
        except ScenarioError as error:
            raise top.error("extends", str(error)) from error
    behaviour = top.string("npc_behaviour", base.npc_behaviour if base else ABSENT)
    paper = _paper(top, base)
    ranges = {key: (low, high) for key, low, high in (base.ranges if base else ())}
    for head in _SECTIONS:
        if head in top.values:
            if paper:
                raise top.error(
                    head,
                    "found ranges in the world of the paper, which has its own; "
                    "expected a domain that extends 'field' or 'calm'",
                )
            _read_section(top, head, ranges)
    if not paper and not ranges and behaviour == ABSENT:
        raise ScenarioError(
            f"{source}: found no range and no NPCs, so nothing may vary; expected a range such as "
            "[wind] mean_mps = [0, 6], or npc_behaviour"
        )
    ordered = tuple((key, *ranges[key]) for key in CONDITIONS if key in ranges)
    return Domain(
        name=name,
        npc_behaviour=behaviour,
        ranges=ordered,
        paper=paper,
        built_in=file.parent == Path(__file__).parent,
    )


def _paper(top: Table, base: Domain | None) -> WeatherRange | None:
    if "paper" not in top.values:
        return base.paper if base else None
    return cast("WeatherRange", top.string("paper", allowed=get_args(WeatherRange)))


def _read_section(top: Table, head: str, ranges: dict[str, tuple[float, float]]) -> None:
    """Change ``ranges`` as a table says; ``false`` takes a group or a condition away."""
    known = {key.partition(".")[2]: key for key in CONDITIONS if key.startswith(f"{head}.")}
    if top.values[head] is False:
        for key in known.values():
            ranges.pop(key, None)
        return
    table = top.table(head)
    table.refuse_unknown(known)
    for name, value in table.values.items():
        key = known[name]
        if value is False:
            ranges.pop(key, None)
        else:
            ranges[key] = _range(table, name, key)


def _range(table: Table, name: str, key: str) -> tuple[float, float]:
    condition, value = CONDITIONS[key], table.get(name)
    numbers = [each for each in value if _is_number(each)] if isinstance(value, list) else []
    if len(numbers) != 2 or len(value) != 2:
        raise table.error(name, f"found {shown(value)}, expected [lowest, highest] or false")
    low, high = (float(each) for each in numbers)
    if low > high:
        raise table.error(name, f"found {shown(value)}, expected the lowest value first")
    if low < condition.low or high > condition.high:
        raise table.error(
            name,
            f"found {shown(value)}, expected values from {condition.low:g} to {condition.high:g}: "
            f"{condition.meaning}",
        )
    if key == ELEVATION and high != NOON_DEG:
        raise table.error(
            name, f"found {shown(value)}, expected it to end at noon, {NOON_DEG:g} degrees"
        )
    if key == BIRD_HEIGHT and low == high:
        raise table.error(name, f"found {shown(value)}, expected two heights")
    return low, high


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)
