"""The tables of an experiment's report, as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from pytest_garl.experiments.metrics import (
    COVERAGE,
    DISTANCE,
    METRICS,
    SIGNATURES,
    MethodSearches,
    Metric,
    published_for,
    searches_in_grid,
)
from pytest_garl.experiments.results import ResultRow
from pytest_garl.experiments.spec import PAPER_TYPES, Experiment, Grid
from pytest_garl.verdicts.statistics import mann_whitney, share_interval, vargha_delaney

NONE = "–"
NOT_RUN = "not run"


def markdown(header: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    rows = [header, ["---"] * len(header), *lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def interval(count: int, total: int) -> str:
    """Return a percentage with its exact 95 % interval."""
    low, high = share_interval(count, total)
    return f"{100 * count / total:.1f} [{100 * low:.1f}, {100 * high:.1f}]"


def _table(
    header: Sequence[str],
    cells_of: Callable[[Experiment, MethodSearches], Sequence[str]],
    experiment: Experiment,
    grid: Grid,
    rows: Sequence[ResultRow],
) -> str:
    """Return a table with a line per map, system and method of a grid."""
    lines = [
        [each.map, each.system, each.method, *cells_of(experiment, each)]
        for each in searches_in_grid(experiment, grid, rows)
    ]
    return markdown(("map", "system", "method", *header), lines)


def effect(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return the table of effect: how often methods find violations, how soon, at what cost."""
    header = (
        "seeds",
        "violations, %",
        "paper",
        "late, %",
        "aborted, %",
        "unavoidable, %",
        "Top-10",
        "paper",
        "hours",
        "paper",
    )
    return _table(header, _effect_cells, experiment, grid, rows)


def _effect_cells(experiment: Experiment, searches: MethodSearches) -> list[str]:
    paper = published_for(experiment, searches)
    theirs = [NONE, NONE, NONE]
    if paper is not None:
        top10 = "cannot find" if paper.top10 == 0 else _number(paper.top10, 0)
        theirs = [_number(paper.violations, 2), top10, _number(paper.hours, 0)]
    if not searches.rows:
        return [NOT_RUN, NONE, theirs[0], *[NONE] * 4, theirs[1], NONE, theirs[2]]
    flights = searches.total(lambda row: row.budget)
    training = experiment.training_h.get(searches.method, 0.0)
    return [
        _numbers(searches.seeds),
        interval(searches.total(lambda row: row.violations), flights),
        theirs[0],
        _share(searches.total(lambda row: row.late), flights),
        _share(searches.total(lambda row: row.aborted), flights),
        _unavoidable(searches),
        ", ".join(NONE if row.top10 is None else str(row.top10) for row in searches.rows),
        theirs[1],
        f"{searches.hours:.2f}" + (f" + {training:.2f}" if training else ""),
        theirs[2],
    ]


def _unavoidable(searches: MethodSearches) -> str:
    tried = searches.total(lambda row: row.piloted or 0)
    found = searches.total(lambda row: row.unavoidable or 0)
    return f"{interval(found, tried)} of {tried}" if tried else NONE


def diversity(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return the table of diversity: of scenarios, of trajectories and of violations."""
    header = (
        "parameter distance",
        "of violating ones",
        "of weather alone",
        "paper",
        "coverage, %",
        "paper",
        "signatures",
    )
    return _table(header, _diversity_cells, experiment, grid, rows)


def _diversity_cells(experiment: Experiment, searches: MethodSearches) -> list[str]:
    paper = published_for(experiment, searches)
    distance = _number(paper.distance if paper else None, 2)
    coverage = _number(paper.coverage if paper else None, 2)
    if not searches.rows:
        return [NOT_RUN, NONE, NONE, distance, NONE, coverage, NONE]
    violating = [
        row.violating_distance for row in searches.rows if row.violating_distance is not None
    ]
    weather = [row.weather_distance for row in searches.rows]
    return [
        f"{searches.mean(DISTANCE):.2f}",
        f"{sum(violating) / len(violating):.2f}" if violating else NONE,
        f"{sum(weather) / len(weather):.3f}",
        distance,
        f"{searches.mean(COVERAGE):.2f}",
        coverage,
        _signatures(searches),
    ]


def _signatures(searches: MethodSearches) -> str:
    counts = [int(count) for count in searches.values(SIGNATURES)]
    return _numbers(counts) + (f" ({searches.all_signatures} in all)" if len(counts) > 1 else "")


def violation_types(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return the table of violation types: shares of the types I to V, and counts of the others."""
    header = (
        f"{' / '.join(PAPER_TYPES)}, %",
        "paper",
        "of",
        "late",
        "off",
        "hard",
        "inconclusive",
    )
    return _table(header, _violation_type_cells, experiment, grid, rows)


def _violation_type_cells(experiment: Experiment, searches: MethodSearches) -> list[str]:
    paper = published_for(experiment, searches)
    theirs = " / ".join(f"{kind:g}" for kind in paper.kinds) if paper and paper.kinds else NONE
    if not searches.rows:
        return [NOT_RUN, theirs, *[NONE] * 5]
    counts = [
        sum(row.type_counts[index] for row in searches.rows) for index in range(len(PAPER_TYPES))
    ]
    total = sum(counts)
    return [
        " / ".join(f"{100 * count / total:.0f}" for count in counts) if total else NONE,
        theirs,
        str(total),
        *(
            str(searches.total(of))
            for of in (
                lambda row: row.late,
                lambda row: row.off,
                lambda row: row.hard,
                lambda row: row.inconclusive,
            )
        ),
    ]


def comparison(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> str:
    """Return U, p and A12 of the first method against each other; empty below two seeds of each."""
    found = searches_in_grid(experiment, grid, rows)
    lines = []
    for one in found:
        if one.method != grid.methods[0] or len(one.rows) < 2:
            continue
        for other in found:
            if (other.system, other.map) != (one.system, one.map) or other is one:
                continue
            if len(other.rows) >= 2:
                seeds = f"{len(one.rows)}, {len(other.rows)}"
                cells = [_compared(one, other, metric) for metric in METRICS]
                lines.append([one.map, one.system, other.method, seeds, *cells])
    if not lines:
        return ""
    header = ("map", "system", f"{grid.methods[0]} against", "seeds")
    return markdown((*header, *(metric.title for metric in METRICS)), lines)


def _compared(one: MethodSearches, other: MethodSearches, metric: Metric) -> str:
    first, second = one.values(metric), other.values(metric)
    u, p = mann_whitney(first, second)
    return f"U {u:g}, p {p:.2f}, A12 {vargha_delaney(first, second):.2f}"


def _numbers(values: Iterable[int]) -> str:
    return ", ".join(str(value) for value in values)


def _number(value: float | None, digits: int) -> str:
    return NONE if value is None else f"{value:.{digits}f}"


def _share(count: int, total: int) -> str:
    return f"{100 * count / total:.1f}"
