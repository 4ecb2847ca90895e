"""The tables of an experiment's report, as Markdown."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence

from lab.experiment.metrics import (
    CAUSES,
    COVERAGE,
    DISTANCE,
    KINDS,
    METRICS,
    PAPER,
    VIOLATIONS,
    MethodSearches,
    Metric,
    searches_in_grid,
)
from lab.experiment.results import ResultRow
from lab.experiment.spec import Experiment, Grid
from pytest_garl.gate.gate_statistics import holm_adjusted
from pytest_garl.verdicts.kinds import hill_number, kinds_in_violations
from pytest_garl.verdicts.statistics import mann_whitney, vargha_delaney

NONE = "–"
NOT_RUN = "not run"
LEAST_VIOLATIONS = 5
"""Among fewer violations hardly any two kinds are told apart, so no search is cut to fewer."""


def markdown(header: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    rows = [header, ["---"] * len(header), *lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _table(
    header: Sequence[str],
    cells_of: Callable[[MethodSearches], Sequence[str]],
    experiment: Experiment,
    grid: Grid,
    rows: Sequence[ResultRow],
) -> str:
    """Return a table with a line per map, system and method of a grid."""
    lines = [
        [each.map, each.system, each.method, *cells_of(each)]
        for each in searches_in_grid(experiment, grid, rows)
    ]
    return markdown(("map", "system", "method", *header), lines)


def effect(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return the table of effect: what became of the flights, how soon, at what cost."""
    header = (
        "seeds",
        "landed, %",
        "violations, %",
        PAPER.title,
        "gave up, %",
        "blocked, %",
        "excused, %",
        "needless, %",
        "definition",
        "Top-10",
        "hours",
    )
    return _table(header, _effect_cells, experiment, grid, rows)


def _effect_cells(searches: MethodSearches) -> list[str]:
    if not searches.rows:
        return [NOT_RUN, *[NONE] * 10]
    return [
        _numbers(searches.seeds),
        _share(searches, lambda row: row.landed),
        _mean_and_values(searches, VIOLATIONS),
        _mean_and_values(searches, PAPER),
        _share(searches, lambda row: row.aborted),
        _share(searches, lambda row: row.blocked),
        _share(searches, lambda row: row.excused),
        _share(searches, lambda row: row.needless),
        " / ".join(searches.definitions),
        ", ".join(NONE if row.top10 is None else str(row.top10) for row in searches.rows),
        f"{searches.hours:.2f}",
    ]


def _mean_and_values(searches: MethodSearches, metric: Metric) -> str:
    """Return the mean over searches and, of several, the value of each."""
    values = searches.values(metric)
    each = f" ({', '.join(f'{value:.1f}' for value in values)})" if len(values) > 1 else ""
    return f"{searches.mean(metric):.1f}{each}"


def diversity(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return the table of diversity: of scenarios, of trajectories and of violations."""
    header = (
        "parameter distance",
        "of violating ones",
        "of weather alone",
        "coverage, %",
        "causes",
        "kinds",
        "effective kinds",
        "kinds at equal violations",
    )
    equal = equal_violations(searches_in_grid(experiment, grid, rows))

    def cells(searches: MethodSearches) -> list[str]:
        drawn = equal.get((searches.system, searches.map))
        return [*_diversity_cells(searches), _rarefied(searches, drawn)]

    return _table(header, cells, experiment, grid, rows)


def _diversity_cells(searches: MethodSearches) -> list[str]:
    if not searches.rows:
        return [NOT_RUN, *[NONE] * 6]
    violating = [
        row.violating_distance for row in searches.rows if row.violating_distance is not None
    ]
    weather = [row.weather_distance for row in searches.rows]
    return [
        f"{searches.mean(DISTANCE):.2f}",
        f"{sum(violating) / len(violating):.2f}" if violating else NONE,
        f"{sum(weather) / len(weather):.3f}",
        f"{searches.mean(COVERAGE):.2f}",
        _distinct(searches, CAUSES, searches.all_causes),
        _distinct(searches, KINDS, searches.all_kinds),
        _of_kinds(searches, lambda counts: hill_number(counts, 1)),
    ]


def effective_kinds(searches: MethodSearches) -> list[float]:
    """Return the Hill number of order 1 of each search.

    All searches of an experiment have one budget, so that these are at equal flights.
    """
    return [hill_number(counts, 1) for counts in searches.kind_counts]


def equal_violations(found: Iterable[MethodSearches]) -> dict[tuple[str, str], int]:
    """Return at how many violations the searches of a system on a map are compared.

    That is the smallest number of a search with at least :data:`LEAST_VIOLATIONS`.
    """
    smallest: dict[tuple[str, str], int] = {}
    for searches in found:
        key = searches.system, searches.map
        for violations in map(sum, searches.kind_counts):
            if violations >= LEAST_VIOLATIONS:
                smallest[key] = min(violations, smallest.get(key, violations))
    return smallest


def _rarefied(searches: MethodSearches, drawn: int | None) -> str:
    if drawn is None:
        return NONE

    def kinds(counts: Sequence[int]) -> float | None:
        return kinds_in_violations(counts, drawn) if sum(counts) >= drawn else None

    return f"{_of_kinds(searches, kinds)} in {drawn}" if searches.rows else NONE


def _of_kinds(searches: MethodSearches, figure_of: Callable[[Sequence[int]], float | None]) -> str:
    """Return a figure of the kinds of each search."""
    figures = map(figure_of, searches.kind_counts)
    return ", ".join(NONE if figure is None else f"{figure:.1f}" for figure in figures)


def _distinct(searches: MethodSearches, metric: Metric, in_all: int) -> str:
    counts = [int(count) for count in searches.values(metric)]
    return _numbers(counts) + (f" ({in_all} in all)" if len(counts) > 1 else "")


def comparison(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return U, p and A12 of the first method against each other; empty below two seeds of each.

    Searches whose rows count violations by different definitions are not compared.
    """
    lines = []
    for one, other in _pairs(experiment, grid, rows):
        cells = [_compared(one.values(metric), other.values(metric)) for metric in METRICS]
        lines.append([one.map, one.system, other.method, _seeds(one, other), *cells])
    if not lines:
        return ""
    header = ("map", "system", f"{grid.methods[0]} against", "seeds")
    return markdown((*header, *(metric.title for metric in METRICS)), lines)


def comparison_of_kinds(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return the same of the effective kinds, with p by Holm over all comparisons of a system.

    Two seeds of each are needed.
    """
    pairs = [
        (one, other, effective_kinds(one), effective_kinds(other))
        for one, other in _pairs(experiment, grid, rows)
    ]
    p_values = [mann_whitney(first, second)[1] for _, _, first, second in pairs]
    adjusted = [0.0] * len(pairs)
    for system in grid.systems:
        own = [place for place, (one, *_) in enumerate(pairs) if one.system == system]
        for place, p in zip(own, holm_adjusted([p_values[each] for each in own]), strict=True):
            adjusted[place] = p
    lines = [
        [
            one.map,
            one.system,
            other.method,
            f"{len(first)}, {len(second)}",
            f"{statistics.fmean(first):.1f}, {statistics.fmean(second):.1f}",
            _compared(first, second),
            f"{p:.2f}",
        ]
        for (one, other, first, second), p in zip(pairs, adjusted, strict=True)
    ]
    if not lines:
        return ""
    first_method = grid.methods[0]
    header = (f"{first_method} against", "seeds", "effective kinds", "test", "p by Holm")
    return markdown(("map", "system", *header), lines)


def _pairs(
    experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]
) -> Iterator[tuple[MethodSearches, MethodSearches]]:
    """Yield the first method with each other of the same system and map, from two seeds of each on.

    Rows of different definitions make no pair.
    """
    found = searches_in_grid(experiment, grid, rows)
    for one in found:
        if one.method != grid.methods[0] or len(one.rows) < 2:
            continue
        for other in found:
            if (other.system, other.map) != (one.system, one.map) or other is one:
                continue
            if len(other.rows) >= 2 and len({*one.definitions, *other.definitions}) == 1:
                yield one, other


def _seeds(one: MethodSearches, other: MethodSearches) -> str:
    return f"{len(one.rows)}, {len(other.rows)}"


def _compared(first: Sequence[float], second: Sequence[float]) -> str:
    u, p = mann_whitney(first, second)
    return f"U {u:g}, p {p:.2f}, A12 {vargha_delaney(first, second):.2f}"


def _numbers(values: Iterable[int]) -> str:
    return ", ".join(str(value) for value in values)


def _share(searches: MethodSearches, count_of: Callable[[ResultRow], int]) -> str:
    """Return the percentage of flights."""
    return f"{100 * searches.sum_of(count_of) / searches.sum_of(lambda row: row.budget):.1f}"
