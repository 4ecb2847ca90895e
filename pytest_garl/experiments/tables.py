"""The tables of an experiment's report, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pytest_garl.experiments.metrics import (
    COVERAGE,
    DISTANCE,
    FIGURES,
    SIGNATURES,
    Figure,
    Sample,
    published,
    samples,
)
from pytest_garl.experiments.results import Row
from pytest_garl.experiments.spec import KINDS, Experiment, Grid
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


def effect(experiment: Experiment, grid: Grid, rows: Sequence[Row]) -> str:
    """Return how often methods violate, how soon, and what it costs."""
    header = (
        "map",
        "system",
        "method",
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
    lines = [
        [each.map, each.system, each.method, *_effect(experiment, each)]
        for each in samples(experiment, grid, rows)
    ]
    return markdown(header, lines)


def _effect(experiment: Experiment, each: Sample) -> list[str]:
    paper = published(experiment, each)
    theirs = [NONE, NONE, NONE]
    if paper is not None:
        top10 = "cannot find" if paper.top10 == 0 else _number(paper.top10, 0)
        theirs = [_number(paper.violations, 2), top10, _number(paper.hours, 0)]
    if not each.rows:
        return [NOT_RUN, NONE, theirs[0], *[NONE] * 4, theirs[1], NONE, theirs[2]]
    flights = each.total(lambda row: row.budget)
    training = experiment.training_h.get(each.method, 0.0)
    return [
        _numbers(each.seeds),
        interval(each.total(lambda row: row.violations), flights),
        theirs[0],
        _share(each.total(lambda row: row.late), flights),
        _share(each.total(lambda row: row.aborted), flights),
        _unavoidable(each),
        ", ".join(NONE if row.top10 is None else str(row.top10) for row in each.rows),
        theirs[1],
        f"{each.hours:.2f}" + (f" + {training:.2f}" if training else ""),
        theirs[2],
    ]


def _unavoidable(each: Sample) -> str:
    tried = each.total(lambda row: row.piloted or 0)
    found = each.total(lambda row: row.unavoidable or 0)
    return f"{interval(found, tried)} of {tried}" if tried else NONE


def spread(experiment: Experiment, grid: Grid, rows: Sequence[Row]) -> str:
    """Return how different the scenarios, the trajectories and the violations are."""
    header = (
        "map",
        "system",
        "method",
        "parameter distance",
        "of violating ones",
        "of weather alone",
        "paper",
        "coverage, %",
        "paper",
        "signatures",
    )
    lines = [
        [each.map, each.system, each.method, *_spread(experiment, each)]
        for each in samples(experiment, grid, rows)
    ]
    return markdown(header, lines)


def _spread(experiment: Experiment, each: Sample) -> list[str]:
    paper = published(experiment, each)
    distance = _number(paper.distance if paper else None, 2)
    coverage = _number(paper.coverage if paper else None, 2)
    if not each.rows:
        return [NOT_RUN, NONE, NONE, distance, NONE, coverage, NONE]
    violating = [row.violating_distance for row in each.rows if row.violating_distance is not None]
    weather = [row.weather_distance for row in each.rows]
    return [
        f"{each.mean(DISTANCE):.2f}",
        f"{sum(violating) / len(violating):.2f}" if violating else NONE,
        f"{sum(weather) / len(weather):.3f}",
        distance,
        f"{each.mean(COVERAGE):.2f}",
        coverage,
        _signatures(each),
    ]


def _signatures(each: Sample) -> str:
    counts = [int(count) for count in each.values(SIGNATURES)]
    return _numbers(counts) + (f" ({each.all_signatures} in all)" if len(counts) > 1 else "")


def kinds(experiment: Experiment, grid: Grid, rows: Sequence[Row]) -> str:
    """Return the types of the violations, as shares of the types I to V, and what is none."""
    header = (
        "map",
        "system",
        "method",
        f"{' / '.join(KINDS)}, %",
        "paper",
        "of",
        "late",
        "off",
        "hard",
        "inconclusive",
    )
    lines = [
        [each.map, each.system, each.method, *_kinds(experiment, each)]
        for each in samples(experiment, grid, rows)
    ]
    return markdown(header, lines)


def _kinds(experiment: Experiment, each: Sample) -> list[str]:
    paper = published(experiment, each)
    theirs = " / ".join(f"{kind:g}" for kind in paper.kinds) if paper and paper.kinds else NONE
    if not each.rows:
        return [NOT_RUN, theirs, *[NONE] * 5]
    counts = [sum(row.kinds[index] for row in each.rows) for index in range(len(KINDS))]
    total = sum(counts)
    return [
        " / ".join(f"{100 * count / total:.0f}" for count in counts) if total else NONE,
        theirs,
        str(total),
        *(
            str(each.total(of))
            for of in (
                lambda row: row.late,
                lambda row: row.off,
                lambda row: row.hard,
                lambda row: row.inconclusive,
            )
        ),
    ]


def comparison(experiment: Experiment, grid: Grid, rows: Sequence[Row]) -> str:
    """Return the first method against each other: U, p and A12; empty below two seeds of each."""
    found = samples(experiment, grid, rows)
    lines = []
    for one in found:
        if one.method != grid.methods[0] or len(one.rows) < 2:
            continue
        for other in found:
            if (other.system, other.map) != (one.system, one.map) or other is one:
                continue
            if len(other.rows) >= 2:
                seeds = f"{len(one.rows)}, {len(other.rows)}"
                cells = [_compared(one, other, figure) for figure in FIGURES]
                lines.append([one.map, one.system, other.method, seeds, *cells])
    if not lines:
        return ""
    header = ("map", "system", f"{grid.methods[0]} against", "seeds")
    return markdown((*header, *(figure.title for figure in FIGURES)), lines)


def _compared(one: Sample, other: Sample, figure: Figure) -> str:
    first, second = one.values(figure), other.values(figure)
    u, p = mann_whitney(first, second)
    return f"U {u:g}, p {p:.2f}, A12 {vargha_delaney(first, second):.2f}"


def _numbers(values: Iterable[int]) -> str:
    return ", ".join(str(value) for value in values)


def _number(value: float | None, digits: int) -> str:
    return NONE if value is None else f"{value:.{digits}f}"


def _share(count: int, total: int) -> str:
    return f"{100 * count / total:.1f}"
