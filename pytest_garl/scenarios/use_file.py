"""The file of a model of use: reads what a user states, and writes an example to edit.

A section for each condition, each cause of weather and each type of NPC says in which share of
landings it occurs, and how its values are distributed.  Every error names the file, the key and
what was expected.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pytest_garl.errors import ScenarioError
from pytest_garl.files.user_files import Table, parse_table, quoted, read_text
from pytest_garl.messages import listed, shown
from pytest_garl.scenarios.genes import SUN, Genome, NuclearGene
from pytest_garl.scenarios.groups import DECIDED, DECOY_KINDS, GROUPS, WEATHER, WEATHER_CAUSES
from pytest_garl.scenarios.light import position_of_elevation, sun_elevation_deg
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.story import STORY
from pytest_garl.scenarios.use_model import Spread, UseModel

SHARE = "share"
SUN_ELEVATION = "sun_elevation_deg"
EXAMPLE_SHARE = 0.1
_SECTIONS = (*WEATHER_CAUSES, *GROUPS, *OBJECT_TYPES)
_NEVER_DRAWN = {DECIDED, DECOY_KINDS[0]}
"""What happens when the director decides, which seeks harm; and a decoy that is none."""
_TOLERANCE = 1e-6
_HEAD = """\
# A model of use: how often each condition and NPC occurs where you land.
#
# THE NUMBERS ARE AN EXAMPLE. None is claimed to be true: replace each by what you know.
#
# share: the share of landings in which it occurs, 0 to 1, each independently of the others; for an
#   NPC the share in which each one of its type is there.
# name = [lowest, highest]: its values, drawn evenly; a visibility evenly in 1 / visibility, the
#   sun evenly over its day. name = [lowest, most frequent, highest]: a triangular distribution.
# name = {kind = weight, ...}: how often each kind occurs, relative to the others.
# A name that you take out has the values of the domain.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class UseFile:
    """What a file states of use: a table for each condition, by its name.

    ``text`` is the content, ``source`` what errors call the file.
    """

    source: str
    text: str
    sections: Mapping[str, Table] = field(compare=False)

    @property
    def sha256(self) -> str:
        """The first digits of the hash of its content."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:12]


def read_use(path: Path) -> UseFile:
    """Return the model of use in a file; raise ScenarioError for what cannot be right."""
    return parse_use(read_text(path), str(path))


def parse_use(text: str, source: str) -> UseFile:
    """Return the model of use in a text; raise ScenarioError for what cannot be right."""
    top = parse_table(text, source)
    top.refuse_unknown(_SECTIONS)
    return UseFile(
        source=source, text=text, sections={name: top.table(name) for name in top.values}
    )


def use_of(use: UseFile, genome: Genome, map: Map) -> UseModel:
    """Return the model of use on a map, for the genome of its domain.

    Raises ScenarioError if the file and the domain do not fit.
    """
    if not any(gene.is_optional for gene in genome.genes):
        raise ScenarioError(
            f"{use.source}: found a domain in which every condition always acts, expected one such "
            "as 'field', whose conditions occur in a share of landings"
        )
    kinds = dict(map.all_objects)
    shares: dict[str, float] = {}
    spreads: dict[str, Spread] = {}
    read = set()
    for gene in genome.genes:
        section = kinds.get(gene.name, gene.name)
        table = use.sections.get(section)
        read.add(section)
        if gene.is_optional:
            shares[gene.name] = _share(use, table, section)
        names = {stated: item.key for item in gene.values if (stated := _stated(item.key, kinds))}
        if table is not None:
            table.refuse_unknown({*names, SHARE} if gene.is_optional else names)
        for item in gene.values:
            name = _stated(item.key, kinds)
            is_stated = table is not None and name in table.values
            spreads[item.key] = (
                _spread(table, name, item) if table is not None and is_stated else _usual(item)
            )
    for section, table in use.sections.items():
        on_no_map = section in OBJECT_TYPES and section not in kinds.values()
        if section not in read and not on_no_map and table.values.get(SHARE) != 0:
            raise table.error(
                "", "found a condition that the domain keeps nominal, expected share = 0, or none"
            )
    return UseModel(
        genome=dataclasses.replace(genome, is_dense=True), shares=shares, spreads=spreads
    )


def _share(use: UseFile, table: Table | None, section: str) -> float:
    if table is None:
        raise ScenarioError(
            f"{use.source}: key {section!r}: missing; expected a table [{section}] with the share "
            "of landings in which it occurs, such as share = 0.1, or share = 0 if it never does"
        )
    return table.number(SHARE, low=0.0, high=1.0)


def _stated(key: str, kinds: Mapping[str, str]) -> str:
    """Return the name of a value in the file; empty for what a user does not state."""
    if key in WEATHER:
        return WEATHER[key].name
    if key == SUN:
        return SUN_ELEVATION
    head, _, name = key.partition(".")
    if head in kinds:
        in_story = name in STORY and not STORY[name].is_place
        return name if in_story or name == "height_m" else ""
    return name if head in GROUPS and head != "light" else ""


def _numbers(item: Quantity) -> Mapping[str, int]:
    """Return the numbers of the choices that use can have, by their names."""
    first, last = math.ceil(item.low), min(int(item.high), len(item.choices) - 1)
    return {
        item.choices[number]: number
        for number in range(first, last + 1)
        if item.choices[number] not in _NEVER_DRAWN
    }


def _usual(item: Quantity) -> Spread:
    """Return how a value is distributed that the file does not state: evenly."""
    if item.choices:
        allowed = set(_numbers(item).values())
        weights = tuple(float(number in allowed) for number in range(max(allowed) + 1))
        return Spread(low=item.low, high=item.high, weights=weights)
    # Half of some draws of stories lie below 0, which is flown as 0.
    told = STORY.get(item.key.partition(".")[2])
    begins = max(0.0, item.low) if told and not told.is_place else item.low
    return Spread(low=begins, high=item.high)


def _spread(table: Table, name: str, item: Quantity) -> Spread:
    if item.choices:
        return _weighted(table, name, item)
    value = table.get(name)
    if not isinstance(value, list) or len(value) not in (2, 3) or not all(map(_is_number, value)):
        raise table.error(
            name,
            f"found {shown(value)}, expected [lowest, highest], or [lowest, most frequent, "
            "highest]",
        )
    numbers = [float(each) for each in value]
    if numbers != sorted(numbers):
        raise table.error(name, f"found {shown(value)}, expected numbers in ascending order")
    genes = sorted(_gene_value(item.key, each) for each in numbers)
    lowest, highest = (0.5 - abs(item.low - 0.5), 0.5) if item.key == SUN else (item.low, item.high)
    slack = _TOLERANCE * max(1.0, abs(item.high))
    if genes[0] < lowest - slack or genes[-1] > highest + slack:
        raise table.error(
            name, f"found {shown(value)}, expected values within the domain: {_range_text(item)}"
        )
    if item.key == SUN and len(genes) == 3:
        raise table.error(name, f"found {shown(value)}, expected [lowest, highest]")
    return Spread(
        low=genes[0],
        high=genes[-1],
        peak=genes[1] if len(genes) == 3 else None,
        mirrored=0.5 if item.key == SUN else None,
    )


def _weighted(table: Table, name: str, item: Quantity) -> Spread:
    known = _numbers(item)
    value = table.get(name)
    if not isinstance(value, Mapping):
        raise table.error(
            name,
            f"found {shown(value)}, expected weights such as {{{next(iter(known))} = 1}}, "
            f"for some of {listed(known)}",
        )
    weights = table.table(name)
    weights.refuse_unknown(known)
    found = [0.0] * (max(known.values()) + 1)
    for each in weights.values:
        found[known[each]] = weights.number(each, low=0.0)
    if not any(found):
        raise table.error(name, f"found {shown(value)}, expected a weight above 0")
    return Spread(low=item.low, high=item.high, weights=tuple(found))


def _gene_value(key: str, value: float) -> float:
    if key in WEATHER:
        return 0.0 if math.isinf(value) else WEATHER[key].share_of(value)
    return position_of_elevation(value) if key == SUN else value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)


def _limits(item: Quantity) -> tuple[float, float]:
    """Return the lowest and the highest value of a domain, in the units of files."""
    if item.key == SUN:
        return round(sun_elevation_deg(item.low), 2), round(sun_elevation_deg(0.5), 2)
    if item.key in WEATHER:
        low, high = sorted(WEATHER[item.key].at(each) for each in (item.low, item.high))
        return low, high
    usual = _usual(item)
    return usual.low, usual.high


def _range_text(item: Quantity) -> str:
    low, high = _limits(item)
    return f"{low:g} and more" if math.isinf(high) else f"{low:g} to {high:g}"


def use_text(named: str, genomes: Sequence[tuple[Genome, Map]]) -> str:
    """Return an example of a model of use for a domain, which a user edits.

    ``genomes`` are those of the domain on the maps where it is to be used.
    """
    genes: dict[str, tuple[NuclearGene, Mapping[str, str]]] = {}
    for genome, map in genomes:
        types = dict(map.all_objects)
        for gene in genome.genes:
            section = types.get(gene.name, gene.name)
            if section in _SECTIONS:
                genes.setdefault(section, (gene, types))
    lines = [_HEAD + f"# The values are those of the domain {named}."]
    for section, (gene, kinds) in genes.items():
        lines += ["", f"[{section}]"]
        lines += [f"{SHARE} = {EXAMPLE_SHARE:g}"] if gene.is_optional else []
        lines += _value_lines(gene, kinds)
    return "\n".join(lines) + "\n"


def _value_lines(gene: NuclearGene, kinds: Mapping[str, str]) -> Iterator[str]:
    for item in gene.values:
        name = _stated(item.key, kinds)
        if not name:
            continue
        if item.choices:
            weights = ", ".join(f"{_key_text(each)} = 1" for each in _numbers(item))
            yield f"{name} = {{ {weights} }}"
            continue
        low, high = _limits(item)
        if high - low > _TOLERANCE:
            yield f"{name} = [{low:.5g}, {high:.5g}]"


def _key_text(name: str) -> str:
    return name if re.fullmatch(r"[\w-]+", name) else quoted(name)
