"""Rows of several seeds as figures: what tables, comparisons, goals and pictures show."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from pytest_garl.experiments.results import Row
from pytest_garl.experiments.spec import Experiment, Grid, Published


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One figure of a search: its title with the unit, its value, how it is written."""

    title: str
    of: Callable[[Row], float]
    digits: int


def _top10(row: Row) -> float:
    # Who never gets there is worse than who does so with the last flight.
    return row.budget + 1 if row.top10 is None else row.top10


VIOLATIONS = Figure(
    title="violations, %", of=lambda row: 100 * row.violations / row.budget, digits=1
)
TOP10 = Figure(title="Top-10, flights", of=_top10, digits=0)
DISTANCE = Figure(title="parameter distance", of=lambda row: row.parameter_distance, digits=2)
COVERAGE = Figure(title="coverage, %", of=lambda row: 100 * row.covered / row.cells, digits=2)
SIGNATURES = Figure(title="signatures", of=lambda row: len(row.signatures), digits=1)
FIGURES = (VIOLATIONS, TOP10, DISTANCE, COVERAGE, SIGNATURES)
"""Those that methods are compared by."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """The searches of one method for one system on one map, in the order of their seeds."""

    system: str
    map: str
    method: str
    rows: tuple[Row, ...]

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds that were flown."""
        return tuple(row.seed for row in self.rows)

    def values(self, figure: Figure, seeds: Iterable[int] | None = None) -> list[float]:
        """Return a figure of each search, or of those with these seeds."""
        wanted = self.seeds if seeds is None else set(seeds)
        return [figure.of(row) for row in self.rows if row.seed in wanted]

    def mean(self, figure: Figure, seeds: Iterable[int] | None = None) -> float:
        """Return a figure's mean over searches."""
        return statistics.fmean(self.values(figure, seeds))

    @property
    def hours(self) -> float:
        """Mean time of a search on as many workers as it had, idle ones included."""
        return statistics.fmean(
            (row.flying_s + row.idle_s) / row.workers / 3600 for row in self.rows
        )

    @property
    def all_signatures(self) -> int:
        """How many distinct signatures all searches found together."""
        return len({name for row in self.rows for name in row.signatures})

    def total(self, of: Callable[[Row], int]) -> int:
        """Return a count's sum over all searches."""
        return sum(of(row) for row in self.rows)


def sample(
    experiment: Experiment,
    rows: Sequence[Row],
    seeds: Iterable[int],
    system: str,
    map: str,
    method: str,
) -> Sample:
    """Return the rows of a method for a system on a map that an experiment asks for."""
    keys = {(system, map, method, seed, experiment.budget) for seed in seeds}
    own = sorted((row for row in rows if row.key in keys), key=lambda row: row.seed)
    return Sample(system=system, map=map, method=method, rows=tuple(own))


def samples(experiment: Experiment, grid: Grid, rows: Sequence[Row]) -> list[Sample]:
    """Return all samples of a grid, those without rows among them: map, system, method."""
    return [
        sample(experiment, rows, grid.seeds, system, map, method)
        for map in grid.maps
        for system in grid.systems
        for method in grid.methods
    ]


def published(experiment: Experiment, each: Sample) -> Published | None:
    """Return what others published for a sample's system, map and method."""
    return next(
        (
            found
            for found in experiment.published
            if (found.system, found.map) == (each.system, each.map) and each.method in found.methods
        ),
        None,
    )
