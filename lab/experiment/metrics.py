"""Metrics by which methods are compared, over the searches of several seeds."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from lab.experiment.results import ResultRow
from lab.experiment.spec import Experiment, Grid, Published


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """One number of a search: its title with the unit, its value in a row, its decimal places."""

    title: str
    value_of: Callable[[ResultRow], float]
    digits: int


def _top10(row: ResultRow) -> float:
    # A search without a tenth violation is worse than one that finds it in its last flight.
    return row.budget + 1 if row.top10 is None else row.top10


VIOLATIONS = Metric(
    title="violations, %", value_of=lambda row: 100 * row.violations / row.budget, digits=1
)
PAPER = Metric(
    title="paper's definition, %",
    value_of=lambda row: 100 * row.paper_violations / row.budget,
    digits=1,
)
TOP10 = Metric(title="Top-10, flights", value_of=_top10, digits=0)
DISTANCE = Metric(title="parameter distance", value_of=lambda row: row.parameter_distance, digits=2)
COVERAGE = Metric(title="coverage, %", value_of=lambda row: 100 * row.covered / row.cells, digits=2)
CAUSES = Metric(title="causes", value_of=lambda row: len(row.causes), digits=1)
KINDS = Metric(title="kinds", value_of=lambda row: len(row.signatures), digits=1)
METRICS = (VIOLATIONS, PAPER, TOP10, DISTANCE, COVERAGE, CAUSES)
OLD = "old"
"""The definition of a row of version 0.1, which does not name its limits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodSearches:
    """The searches of one method for one system on one map, in the order of their seeds."""

    system: str
    map: str
    method: str
    rows: tuple[ResultRow, ...]

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds that were flown."""
        return tuple(row.seed for row in self.rows)

    def values(self, metric: Metric, seeds: Iterable[int] | None = None) -> list[float]:
        """Return the metric of each search, or of those with these seeds."""
        wanted = self.seeds if seeds is None else set(seeds)
        return [metric.value_of(row) for row in self.rows if row.seed in wanted]

    def mean(self, metric: Metric, seeds: Iterable[int] | None = None) -> float:
        """Return the mean of the metric over searches."""
        return statistics.fmean(self.values(metric, seeds))

    @property
    def hours(self) -> float:
        """The mean duration of a search on its workers, with the time that they were idle."""
        return statistics.fmean(
            (row.flying_s + row.idle_s) / row.workers / 3600 for row in self.rows
        )

    @property
    def definitions(self) -> tuple[str, ...]:
        """The definitions by which the rows count violations: their limits, or :data:`OLD`."""
        return tuple(sorted({row.limits or OLD for row in self.rows}))

    @property
    def all_causes(self) -> int:
        """The number of distinct types and causes that all searches found together."""
        return len({cause for row in self.rows for cause in row.causes})

    @property
    def all_kinds(self) -> int:
        """The number of distinct kinds of violation that all searches found together."""
        return len({name for row in self.rows for name in row.signatures})

    @property
    def kind_counts(self) -> list[tuple[int, ...]]:
        """The violations of each kind, of each search whose row tells them."""
        return [row.counts for row in self.rows if row.counts is not None]

    def sum_of(self, count_of: Callable[[ResultRow], int | None]) -> int | None:
        """Return the sum of a count over all searches; None if a row does not hold it."""
        counts = [count_of(row) for row in self.rows]
        return None if None in counts else sum(count or 0 for count in counts)


def searches_of_method(
    experiment: Experiment,
    rows: Sequence[ResultRow],
    seeds: Iterable[int],
    system: str,
    map: str,
    method: str,
) -> MethodSearches:
    """Return the rows of a method for a system on a map that belong to an experiment."""
    keys = {(system, map, method, seed, experiment.budget) for seed in seeds}
    own = sorted((row for row in rows if row.key in keys), key=lambda row: row.seed)
    return MethodSearches(system=system, map=map, method=method, rows=tuple(own))


def searches_in_grid(
    experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]
) -> list[MethodSearches]:
    """Return the searches of each map, system and method of a grid, also of those without rows."""
    return [
        searches_of_method(experiment, rows, grid.seeds, system, map, method)
        for map in grid.maps
        for system in grid.systems
        for method in grid.methods
    ]


def published_for(experiment: Experiment, searches: MethodSearches) -> Published | None:
    """Return the published figures for the system, map and method of the searches."""
    return next(
        (
            each
            for each in experiment.published
            if (each.system, each.map) == (searches.system, searches.map)
            and searches.method in each.methods
        ),
        None,
    )
