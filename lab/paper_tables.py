"""Write the paper's tables beside those of this code: ``python -m lab.paper_tables``.

The rows are those of ``docs/results/experiments/paper.csv``, which ``python -m lab.experiment
docs/results/experiments/paper.toml`` flies, and of ``paper-differences.csv`` beside it, which
``python -m lab.paper_differences`` flies; the page is ``docs/results/paper.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from lab.experiment.metrics import (
    ITS_CODE,
    ITS_COVERAGE,
    ITS_TOP10,
    PAPER,
    VIOLATIONS,
    MethodSearches,
    Metric,
)
from lab.experiment.metrics import searches_in_grid as searches_of
from lab.experiment.results import ResultRow, read_rows
from lab.experiment.spec import Experiment, read_experiment
from lab.experiment.tables import NONE, markdown
from lab.judges.intervals import p_of_signs
from lab.paper_claims import OWN, WEATHER_DISTANCE, claim_lines
from lab.paper_differences import FLIGHTS, MAP, OURS, SEEDS, SYSTEMS, TABLE, WORLDS
from lab.table import Row

ROOT = Path(__file__).parents[1]
SPEC = ROOT / "docs" / "results" / "experiments" / "paper.toml"
PAGE = ROOT / "docs" / "results" / "paper.md"
BEGIN = "<!-- {}: python -m lab.paper_tables -->\n"
END = "<!-- end of the {} -->\n"
SHARES = MappingProxyType({"ours": "our definition, %", "code": "its code, %"})
"""What the worlds are compared by: the column, and its title."""

PUBLISHED_SHARES = MappingProxyType(
    {
        ("OpenCV-MLS", "court"): 71.50,
        ("TPHYolo-MLS", "court"): 30.96,
        ("MM-MLS", "court"): 20.60,
        ("OpenCV-MLS", "lawn"): 42.75,
        ("TPHYolo-MLS", "lawn"): 38.25,
        ("MM-MLS", "lawn"): 17.11,
    }
)
"""Violations in percent of flights that GARL found: the paper's table of RQ1."""
PUBLISHED_METHODS = MappingProxyType(
    {
        ("garl-paper", "court"): ("20.60", "42", "0.19", "11.24", "12"),
        ("garl-paper", "lawn"): ("17.11", "76", "0.19", "11.94", "12"),
        ("ga", "court"): ("14.25", "73", "0.16", "4.92", "11"),
        ("ga", "lawn"): ("9.23", "113", "0.16", "8.43", "11"),
        ("random", "court"): ("9.37", "205", "0.13", "3.51", "11"),
        ("random", "lawn"): ("8.52", "112", "0.13", "4.92", "11"),
        ("offline-rl", "court"): ("2.25", NONE, "0.12", "1.41", "11"),
        ("offline-rl", "lawn"): ("2.13", NONE, "0.12", "3.51", "11"),
        ("online-rl", "court"): ("12.75", "104", "0.13", "4.92", "11"),
        ("online-rl", "lawn"): ("5.94", "141", "0.13", "7.03", "11"),
        ("surrogate-random", "court"): ("14.19", "67", "0.13", "8.43", "12"),
        ("surrogate-random", "lawn"): ("13.53", "108", "0.13", "8.43", "12"),
    }
)
"""Violations in percent, Top-10, parameter distance, coverage in percent, hours: the paper's table
of RQ2, of MM-MLS."""
TYPES: Mapping[str, Callable[[ResultRow], int]] = MappingProxyType(
    {
        "I": lambda row: row.type_i,
        "II": lambda row: row.type_ii,
        "III": lambda row: row.type_iii,
        "IV": lambda row: row.type_iv,
        "V": lambda row: row.type_v,
    }
)


def tables(experiment: Experiment, rows: Sequence[ResultRow]) -> str:
    """Return what is flown and the tables of both questions, in Markdown."""
    keys = {row.key for row in rows}
    wanted = {
        (each.system, each.map, each.method, seed, experiment.budget, grid.domain)
        for grid in experiment.grids
        for each in searches_of(experiment, grid, rows)
        for seed in grid.seeds
    }
    flown = (
        f"{len(wanted & keys)} of {len(wanted)} searches of {experiment.budget} flights are flown."
    )
    parts = flown, *(make(experiment, rows) for make in (_landing_systems, _methods, _paired))
    return "\n\n".join(part for part in parts if part) + "\n"


def _landing_systems(experiment: Experiment, rows: Sequence[ResultRow]) -> str:
    """Return the table of RQ1: how often, and how, the landing systems fail.

    Types of which there is no violation have no column.
    """
    lines, seen = [], [count for count in TYPES.values() if any(count(row) for row in rows)]
    for each in searches_of(experiment, experiment.grids[0], rows):
        published = f"{PUBLISHED_SHARES[each.system, each.map]:.1f}"
        lines.append(
            [
                each.map,
                each.system,
                each.method,
                published if each.method == OWN else NONE,
                *(_mean(each, metric) for metric in (ITS_CODE, PAPER, VIOLATIONS)),
                *(_per_100(each, count) for count in seen),
                _per_100(each, _others),
            ]
        )
    header = (
        "map",
        "system",
        "method",
        "paper, %",
        ITS_CODE.title,
        PAPER.title,
        "our definition, %",
    )
    names = (name for name, count in TYPES.items() if count in seen)
    return markdown((*header, *names, "others"), lines)


def _methods(experiment: Experiment, rows: Sequence[ResultRow]) -> str:
    """Return the table of RQ2: each figure of the paper, a slash, and that of this code."""
    lines = []
    searches = [one for grid in experiment.grids[1:] for one in searches_of(experiment, grid, rows)]
    for each in searches:
        shares, top10, distance, coverage, hours = PUBLISHED_METHODS.get(
            (each.method, each.map), (NONE,) * 5
        )
        lines.append(
            [
                each.map,
                each.method,
                f"{shares} / {_mean(each, ITS_CODE)}",
                _mean(each, PAPER),
                _mean(each, VIOLATIONS),
                f"{top10} / {_mean(each, ITS_TOP10)}",
                f"{distance} / {_mean(each, WEATHER_DISTANCE)}",
                f"{coverage} / {_mean(each, ITS_COVERAGE)}",
                f"{hours} / {each.hours:.2f}" if each.rows else f"{hours} / {NONE}",
            ]
        )
    header = ("map", "method", "violations, %", PAPER.title, "our definition, %", "Top-10")
    return markdown((*header, "distance", "coverage, %", "hours"), lines)


def _paired(experiment: Experiment, rows: Sequence[ResultRow]) -> str:
    """Return methods less their rivals, paired by map and seed; empty without pairs.

    The paper's method has the rivals of the paper, ``garl`` those of a grid of its own.  The first
    of these, with learned NPCs, is compared with the others as well, and the last, with the NPCs
    that the paper's authors trained, with those that this code trained as the paper says.
    """
    found = {(row.map, row.method, row.seed): row for row in rows if row.system == "MM-MLS"}
    _, papers, own_rivals = experiment.grids
    learned, *others = own_rivals.methods
    rivals = [
        *((papers, OWN, each) for each in papers.methods if each != OWN),
        *((own_rivals, "garl", each) for each in own_rivals.methods),
        *((own_rivals, learned, each) for each in others),
        (own_rivals, "surrogate-random", others[-1]),
    ]
    lines = []
    for grid, own, rival in rivals:
        pairs = [
            (found[map, own, seed], found[map, rival, seed])
            for map in grid.maps
            for seed in grid.seeds
            if (map, own, seed) in found and (map, rival, seed) in found
        ]
        if not pairs:
            continue
        cells = []
        for metric in (ITS_CODE, VIOLATIONS):
            gaps = [metric.value_of(one) - metric.value_of(other) for one, other in pairs]
            cells.append(f"{np.mean(gaps):+.{metric.digits}f} ({p_of_signs(gaps):.2f})")
        lines.append([own, rival, str(len(pairs)), *cells])
    header = ("method", "less", "pairs", ITS_CODE.title, "our definition, %")
    return markdown(header, lines) if lines else ""


def _mean(searches: MethodSearches, metric: Metric) -> str:
    return f"{searches.mean(metric):.{metric.digits}f}" if searches.rows else NONE


def _per_100(searches: MethodSearches, count_of: Callable[[ResultRow], int]) -> str:
    """Return how many of a hundred flights count, over all seeds."""
    flights = searches.sum_of(lambda row: row.budget)
    return f"{100 * searches.sum_of(count_of) / flights:.1f}" if flights else NONE


def claims(rows: Sequence[ResultRow]) -> str:
    """Return the table of the paper's claims, in Markdown."""
    return markdown(("claim", "here", "verdict"), claim_lines(rows)) + "\n"


def in_our_world(rows: Sequence[ResultRow]) -> list[Row]:
    """Return the experiment's searches that those of the other worlds are compared with."""
    return [
        {
            "system": row.system,
            "world": OURS,
            "seed": str(row.seed),
            "flights": str(row.budget),
            "ours": str(row.violations),
            "code": str(row.its_code),
        }
        for row in rows
        if (row.method, row.map, row.budget) == (OWN, MAP.name, FLIGHTS)
    ]


def _others(row: ResultRow) -> int:
    return row.late + row.off + row.hard + row.slid


def differences(flown: Sequence[Row], ours: Sequence[Row]) -> str:
    """Return the tables of the worlds between the paper's and ours, in Markdown."""
    rows, worlds = (*ours, *flown), (OURS, *WORLDS)
    count = len(worlds) * len(SYSTEMS) * len(SEEDS)
    shares, pairs = [], []
    for system in SYSTEMS:
        own = [
            [row for row in rows if (row["system"], row["world"]) == (system, world)]
            for world in worlds
        ]
        for name, title in SHARES.items():
            shares.append([system, title, *(_share(each, name) for each in own)])
    found = {(row["system"], row["seed"], row["world"]): row for row in rows}
    for world in WORLDS:
        keys = [
            (system, str(seed))
            for system in SYSTEMS
            for seed in SEEDS
            if (system, str(seed), world) in found and (system, str(seed), OURS) in found
        ]
        if keys:
            lines = [(found[*key, world], found[*key, OURS]) for key in keys]
            gaps = ([int(own[name]) - int(other[name]) for own, other in lines] for name in SHARES)
            pairs.append(
                [world, str(len(keys)), *(f"{np.mean(g):+.1f} ({p_of_signs(g):.3f})" for g in gaps)]
            )
    parts = [
        f"{len(rows)} of {count} searches of {FLIGHTS} flights are flown.",
        markdown(("system", "violations", *worlds), shares),
        markdown(("world less ours", "pairs", *SHARES.values()), pairs) if pairs else "",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _share(rows: Sequence[Row], name: str) -> str:
    """Return a count in percent of the flights."""
    flights = sum(int(row["flights"]) for row in rows)
    return f"{100 * sum(int(row[name]) for row in rows) / flights:.1f}" if rows else NONE


def with_tables(page: str) -> str:
    """Return the page with the tables of today's rows."""
    experiment = read_experiment(SPEC)
    rows = read_rows(experiment.rows)
    page = _with(page, "tables", tables(experiment, rows))
    page = _with(page, "claims", claims(rows))
    return _with(page, "differences", differences(TABLE.rows(), in_our_world(rows)))


def _with(page: str, name: str, text: str) -> str:
    """Return the page with a text between the two lines that name it."""
    first, last = BEGIN.format(name), END.format(name)
    head, begin, rest = page.partition(first)
    _, end, tail = rest.partition(last)
    if not begin or not end:
        raise SystemExit(f"{PAGE}: found no lines {first!r} and {last!r}")
    return f"{head}{begin}\n{text}\n{end}{tail}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text()))
