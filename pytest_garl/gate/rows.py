"""The flights of a baseline, one line each: a scenario and the result of its flight.

In a set of dense scenarios all flights have the same genes.  A sparse scenario has, beside weather
and marker, only the objects that are there and what is not nominal: its line ends with these.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args

from pytest_garl.files.user_files import LARGEST_INTEGER, Table, finite, quoted
from pytest_garl.flight.flight import Outcome
from pytest_garl.gate.pairs import NOT_LANDED, FlightSummary, NoLanding
from pytest_garl.messages import listed, printable, shown
from pytest_garl.scenarios.genes import object_gene
from pytest_garl.scenarios.genome_like import genome_like
from pytest_garl.scenarios.groups import QUANTITIES
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY
from pytest_garl.scenarios.task import Task
from pytest_garl.scenarios.units import HEIGHT, ranges_of

_OUTCOMES = get_args(Outcome)
_ALWAYS = ("environment", "marker")
"""Subjects of the genes that every scenario has."""


def is_sparse(scenarios: Iterable[Scenario]) -> bool:
    """Return whether scenarios differ in their genes or may lack conditions and objects."""
    shapes = {tuple(key for key, _ in each.genes): each.removed_objects for each in scenarios}
    (*_, keys) = shapes
    return (
        len(shapes) > 1
        or any(shapes.values())
        or any(key in QUANTITIES or key.endswith(f".{HEIGHT}") for key in keys)
    )


def listed_genes(scenario: Scenario, sparse: bool) -> tuple[str, ...]:
    """Return the genes whose values each line lists."""
    keys = (key for key, _ in scenario.genes)
    return tuple(key for key in keys if not sparse or key.partition(".")[0] in _ALWAYS)


def row_text(scenario: Scenario, summary: FlightSummary, keys: Sequence[str], sparse: bool) -> str:
    """Return the line of a flight."""
    values = ", ".join(repr(value) for key, value in scenario.genes if key in keys)
    further = ", ".join(
        f"{quoted(key)} = {value!r}" for key, value in scenario.genes if key not in keys
    )
    landing = ""
    if summary.distance_m is not None and summary.time_s is not None:
        landing = f"{summary.distance_m!r}, {summary.time_s!r}"
    return (
        f"[{scenario.seed}, {quoted(summary.outcome)}, {quoted(summary.signature)}, "
        f"{str(summary.paper_violation).lower()}, {quoted(summary.no_landing)}, [{landing}], "
        f"{quoted(summary.sha256)}, [{values}]{f', {{{further}}}' if sparse else ''}]"
    )


@dataclass(frozen=True, kw_only=True)
class RowReader:
    """Reads the flights of the set in ``table``, whose lines list the genes ``keys``."""

    table: Table
    map: Map
    keys: tuple[str, ...]
    task: Task

    @cached_property
    def sparse(self) -> bool:
        """Whether each line ends with further genes."""
        return self.table.boolean("sparse", default=False)

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest value of each gene that a line lists, in their order.

        Raises ScenarioError if these are not the genes that a set on the map has.
        """
        genome = genome_like(self.keys, self.map)
        known = tuple(
            key for key in genome.keys if not self.sparse or key.partition(".")[0] in _ALWAYS
        )
        if self.keys != known:
            wrong = sorted({*self.keys} ^ {*known})
            raise self.table.error(
                "genes",
                f"found genes other than those of the map {self.map.name!r}, or in another order "
                f"({listed(wrong) or 'order'}); if the map has changed, save a baseline anew",
            )
        return {item.key: (item.low, item.high) for item in genome.properties if item.key in known}

    def read(self, key: str, row: Any) -> tuple[Scenario, FlightSummary]:
        """Return scenario and result in a line; raise ScenarioError that names the key."""
        kinds = (int, str, str, bool, str, list, str, list, *([dict] * self.sparse))
        if (
            not isinstance(row, list)
            or len(row) != len(kinds)
            or any(type(item) is not kind for item, kind in zip(row, kinds, strict=True))
        ):
            raise self.table.error(
                key,
                f"found {shown(row)}, expected [seed, outcome, signature, true or false, why it "
                "did not land, [distance, time] or [], hash, [genes]"
                f"{', {further genes}' * self.sparse}]",
            )
        seed, outcome, signature, paper_violation, no_landing, landing, sha256, values = row[:8]
        if not 0 <= seed <= LARGEST_INTEGER:
            raise self.table.error(
                key,
                f"found the seed {shown(seed)}, expected a whole number from 0 to "
                f"{LARGEST_INTEGER}",
            )
        for word, words in ((outcome, _OUTCOMES), (no_landing, get_args(NoLanding))):
            if word not in words:
                known = ", ".join(each or "nothing" for each in words)
                raise self.table.error(key, f"found {shown(word)}, expected one of {known}")
        if bool(no_landing) is not (outcome in NOT_LANDED):
            expected = "a reason" if outcome in NOT_LANDED else "none"
            raise self.table.error(
                key,
                f"found {no_landing or 'no reason'!r} why the outcome {outcome} did not land, "
                f"expected {expected}",
            )
        if outcome == "landed" and not landing:
            raise self.table.error(
                key, "found [] beside the outcome landed, expected [distance, time]"
            )
        distance_m, time_s = self._landing(key, landing)
        genes = self._listed(key, values)
        removed: tuple[str, ...] = ()
        if self.sparse:
            further = row[8]
            genes += self._further(key, further)
            there = {name.partition(".")[0] for name in further}
            removed = tuple(sorted(name for name, _ in self.map.all_objects if name not in there))
        return (
            Scenario(
                map=self.map.name, seed=seed, genes=genes, removed_objects=removed, task=self.task
            ),
            FlightSummary(
                outcome=outcome,
                signature=printable(signature),
                paper_violation=paper_violation,
                no_landing=no_landing,
                distance_m=distance_m,
                time_s=time_s,
                sha256=printable(sha256),
            ),
        )

    def _listed(self, key: str, values: list[Any]) -> tuple[tuple[str, float], ...]:
        if len(values) != len(self.ranges):
            raise self.table.error(
                key, f"found {len(values)} values of genes, expected {len(self.ranges)}"
            )
        return tuple(
            (name, self._value(key, name, value, limits))
            for (name, limits), value in zip(self.ranges.items(), values, strict=True)
        )

    def _further(self, key: str, further: dict[str, Any]) -> tuple[tuple[str, float], ...]:
        """Return the genes of the objects that are there, and the conditions."""
        genes = []
        for name, value in further.items():
            if name not in self._known:
                raise self.table.error(
                    key,
                    f"found the gene {shown(name)}, expected a condition, or a gene of an object "
                    f"on the map {self.map.name!r}; if the map has changed, save a baseline anew",
                )
            genes.append((name, self._value(key, name, value, self._known[name])))
        for name, _ in self.map.all_objects:
            needed = {item.key for item in object_gene(name).properties}
            missing = sorted(needed - {*further})
            if missing and any(gene.startswith(f"{name}.") for gene in further):
                raise self.table.error(key, f"{name}: {listed(missing)} missing")
        return tuple(genes)

    @cached_property
    def _known(self) -> dict[str, tuple[float, float]]:
        names = [name for name, _ in self.map.all_objects]
        keys = [f"{name}.{each}" for name in names for each in ("destination_x", *STORY)]
        genome = genome_like(keys, self.map)
        known = {item.key: (item.low, item.high) for item in genome.properties}
        known = {key: limits for key, limits in known.items() if key.partition(".")[0] in names}
        for name in names:
            ranges = ranges_of(name, self.map)
            if HEIGHT in ranges:
                known[f"{name}.{HEIGHT}"] = ranges[HEIGHT]
        return known | {key: (each.low, each.high) for key, each in QUANTITIES.items()}

    def _value(self, key: str, name: str, value: Any, limits: tuple[float, float]) -> float:
        number, (low, high) = finite(value), limits
        if number is None or not low <= number <= high:
            raise self.table.error(
                key, f"{name}: found {shown(value)}, expected {low:g} to {high:g}"
            )
        return float(number)

    def _landing(self, key: str, landing: list[Any]) -> tuple[float, float] | tuple[None, None]:
        """Return distance and time of a landing, None for both without one."""
        if not landing:
            return None, None
        numbers = [finite(each) for each in landing]
        match numbers:
            case [float(distance_m), float(time_s)] if distance_m >= 0 and time_s >= 0:
                return distance_m, time_s
        raise self.table.error(
            key, f"found {shown(landing)}, expected [distance in m, time in s] or []"
        )
