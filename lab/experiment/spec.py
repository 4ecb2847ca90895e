"""The specification of an experiment: its searches and its report, from one TOML file."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.files.user_files import LARGEST_INTEGER, Table, read_table
from pytest_garl.messages import listed, shown

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]*")
_MOST_GRIDS = 100
_MOST_SEARCHES = 10_000
_MOST_FLIGHTS = 1_000_000
"""Largest budget of a search: more than a year of flying."""
WITH = " with "
"""Separates a search method and an NPC policy."""
PAPER = "paper"
"""The domain of experiments that name none: the world of the paper."""
PAPER_TYPES = ("I", "II", "III", "IV", "V")
_MOST_SCENARIOS = 1000
"""Largest population."""
TOP_KEYS = frozenset(
    {
        *("title", "text", "report", "budget", "population", "domain"),
        *("seeds", "maps", "systems", "grids"),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentRun:
    """One pytest session: a method's searches on all maps, from one seed.

    ``system`` is the name in tables and rows, ``tests`` the argument of pytest.  ``method`` is a
    search method, or "method with policy" if another NPC policy replaces the method's own.
    ``domain`` is a name or a TOML file, as ``--garl-domain`` takes it.  ``population`` is the
    number of scenarios in a generation, 0 for pytest's own.
    """

    system: str
    tests: str
    domain: str
    maps: tuple[str, ...]
    method: str
    seed: int
    budget: int
    population: int = 0

    @property
    def search_method(self) -> str:
        """The search method without the NPC policy."""
        return self.method.partition(WITH)[0]

    @property
    def npcs(self) -> str:
        """The NPC policy; empty for the method's own."""
        return self.method.partition(WITH)[2]

    @property
    def title(self) -> str:
        """The run in one line."""
        where = " and ".join(self.maps)
        return (
            f"{self.system}, {self.method}, seed {self.seed}, {self.budget} flights on {where}, "
            f"domain {self.domain}"
        )

    @property
    def folder(self) -> str:
        """The name of the folder of its ledger; different runs have different names."""
        words = (self.system, self.method, f"seed{self.seed}", str(self.budget), *self.maps)
        digest = hashlib.sha256(
            repr((self.tests, self.domain, self.population, *words)).encode()
        ).hexdigest()[:6]
        return re.sub(r"[^A-Za-z0-9]+", "-", "-".join((*words, digest)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """A section of the report with its own tables: systems × maps × methods × seeds, in a domain.

    ``text`` and ``remarks`` are Markdown: the question before the tables, the answer after them.
    """

    name: str
    title: str
    text: str
    remarks: str
    domain: str
    systems: tuple[str, ...]
    maps: tuple[str, ...]
    methods: tuple[str, ...]
    seeds: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """An experiment, as specified in its file."""

    file: Path
    rows: Path
    report: Path
    title: str
    text: str
    budget: int
    population: int
    systems: Mapping[str, str]
    grids: tuple[Grid, ...]

    @property
    def runs(self) -> tuple[ExperimentRun, ...]:
        """All runs, each once: the first seed of every grid first, else in the file's order."""
        found: dict[tuple[str, str, str, int], tuple[str, ...]] = {}
        for turn in range(max(len(grid.seeds) for grid in self.grids)):
            for grid in self.grids:
                for seed in grid.seeds[turn : turn + 1]:
                    for system in grid.systems:
                        for method in grid.methods:
                            key = (grid.domain, system, method, seed)
                            found[key] = tuple(dict.fromkeys((*found.get(key, ()), *grid.maps)))
        return tuple(
            ExperimentRun(
                system=system,
                tests=self.systems[system],
                domain=domain,
                maps=maps,
                method=method,
                seed=seed,
                budget=self.budget,
                population=self.population,
            )
            for (domain, system, method, seed), maps in found.items()
        )


def read_experiment(file: Path) -> Experiment:
    """Return the experiment in ``file``; raise ScenarioError that names file and key."""
    top = read_table(file)
    top.refuse_unknown(TOP_KEYS)
    systems = top.table("systems")
    names = {_named(systems, name): systems.string(name) for name in systems.values}
    grids = tuple(_grid(top, each, names) for each in top.tables("grids", most=_MOST_GRIDS))
    if not grids:
        raise top.error("grids", "missing; expected at least one [[grids]] with methods to fly")
    twice = {grid.name for grid in grids if sum(grid.name == each.name for each in grids) > 1}
    if twice:
        raise top.error("grids", f"found {listed(sorted(twice))} twice, expected each name once")
    searches = sum(
        len(each.systems) * len(each.maps) * len(each.methods) * len(each.seeds) for each in grids
    )
    if searches > _MOST_SEARCHES:
        raise top.error("grids", f"found {searches} searches, expected at most {_MOST_SEARCHES}")
    return Experiment(
        file=file,
        rows=file.with_suffix(".csv"),
        report=Path(os.path.normpath(file.parent / top.string("report", f"{file.stem}.md"))),
        title=top.string("title"),
        text=top.string("text", "").strip(),
        budget=top.integer("budget", low=1, high=_MOST_FLIGHTS),
        population=top.integer("population", 0, low=0, high=_MOST_SCENARIOS),
        systems=names,
        grids=grids,
    )


def _named(table: Table, name: str) -> str:
    if not NAME.fullmatch(name):
        raise table.error(name, "expected a name of letters, digits, spaces and . _ -")
    return name


def _grid(top: Table, table: Table, systems: Collection[str]) -> Grid:
    table.refuse_unknown(
        {"name", "title", "text", "remarks", "domain", "systems", "maps", "methods", "seeds"}
    )
    name = _named(table, table.string("name"))
    return Grid(
        name=name,
        title=table.string("title", name),
        text=table.string("text", "").strip(),
        remarks=table.string("remarks", "").strip(),
        domain=(table if "domain" in table.values else top).string("domain", PAPER),
        systems=_some(table, "systems", allowed=systems)
        if "systems" in table.values
        else (*systems,),
        maps=_some(table if "maps" in table.values else top, "maps"),
        methods=_some(table, "methods"),
        seeds=_seeds(table if "seeds" in table.values else top),
    )


def _some(table: Table, key: str, allowed: Collection[str] = ()) -> tuple[str, ...]:
    """Return a list of names that is not empty and has no name twice."""
    found = table.strings(key)
    if not found or len(set(found)) < len(found):
        raise table.error(key, f"found {shown(list(found))}, expected names, each once")
    for name in found:
        if allowed and name not in allowed:
            raise table.error(key, f"found {shown(name)}, expected some of {listed(allowed)}")
    return found


def _seeds(table: Table) -> tuple[int, ...]:
    found = table.get("seeds")
    good = isinstance(found, list) and all(
        type(seed) is int and 0 <= seed <= LARGEST_INTEGER for seed in found
    )
    if not good or not found or len(set(found)) < len(found):
        raise table.error(
            "seeds", f"found {shown(found)}, expected whole numbers from 0, each once"
        )
    return tuple(found)
