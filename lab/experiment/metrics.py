"""Metrics by which methods are compared, over the searches of several seeds."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lab.experiment.results import ResultRow
from lab.experiment.spec import Experiment, Grid


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """One number of a search: its title with the unit, its value in a row, its decimal places."""

    title: str
    value_of: Callable[[ResultRow], float]
    digits: int


def _top10(budget: int, found: int | None) -> float:
    # A search without a tenth violation is worse than one that finds it in its last flight.
    return budget + 1 if found is None else found


VIOLATIONS = Metric(
    title="violations, %", value_of=lambda row: 100 * row.violations / row.budget, digits=1
)
PAPER = Metric(
    title="paper's definition, %",
    value_of=lambda row: 100 * row.paper / row.budget,
    digits=1,
)
TOP10 = Metric(
    title="Top-10, flights", value_of=lambda row: _top10(row.budget, row.top10), digits=0
)
ITS_CODE = Metric(
    title="its code, %", value_of=lambda row: 100 * row.its_code / row.budget, digits=1
)
ITS_TOP10 = Metric(
    title="Top-10 by its code", value_of=lambda row: _top10(row.budget, row.its_top10), digits=0
)
ITS_COVERAGE = Metric(
    title="coverage by its code, %",
    value_of=lambda row: 100 * row.its_covered / row.cells,
    digits=2,
)
DISTANCE = Metric(title="parameter distance", value_of=lambda row: row.parameter_distance, digits=2)
COVERAGE = Metric(title="coverage, %", value_of=lambda row: 100 * row.covered / row.cells, digits=2)
CAUSES = Metric(title="causes", value_of=lambda row: len(row.causes), digits=1)
KINDS = Metric(title="kinds", value_of=lambda row: len(row.signatures), digits=1)
METRICS = (VIOLATIONS, PAPER, TOP10, DISTANCE, COVERAGE, CAUSES)


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

    def values(self, metric: Metric) -> list[float]:
        """Return the metric of each search."""
        return [metric.value_of(row) for row in self.rows]

    def mean(self, metric: Metric) -> float:
        """Return the mean of the metric over searches."""
        return statistics.fmean(self.values(metric))

    @property
    def hours(self) -> float:
        """The mean duration of a search on its workers, with the time that they were idle."""
        return statistics.fmean(
            (row.flying_s + row.idle_s) / row.workers / 3600 for row in self.rows
        )

    @property
    def definitions(self) -> tuple[str, ...]:
        """The limits by which the rows count violations."""
        return tuple(sorted({row.limits for row in self.rows}))

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
        """The violations of each kind, of each search."""
        return [row.kind_counts for row in self.rows]

    def sum_of(self, count_of: Callable[[ResultRow], int]) -> int:
        """Return the sum of a count over all searches."""
        return sum(map(count_of, self.rows))


def searches_in_grid(
    experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]
) -> list[MethodSearches]:
    """Return the searches of each map, system and method of a grid, also of those without rows."""
    wanted = sorted(
        (
            row
            for row in rows
            if (row.budget, row.domain) == (experiment.budget, grid.domain)
            and row.seed in grid.seeds
        ),
        key=lambda row: row.seed,
    )
    return [
        MethodSearches(
            system=system,
            map=map,
            method=method,
            rows=tuple(row for row in wanted if row.key[:3] == (system, map, method)),
        )
        for map in grid.maps
        for system in grid.systems
        for method in grid.methods
    ]
