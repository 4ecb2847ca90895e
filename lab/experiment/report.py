"""The report of an experiment: one Markdown file, written from its TOML file and rows alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from lab.experiment import tables
from lab.experiment.campaign import missing_runs
from lab.experiment.metrics import searches_in_grid
from lab.experiment.results import ResultRow
from lab.experiment.spec import Experiment, ExperimentRun, Grid
from pytest_garl.files.atomic import write_text_atomically
from pytest_garl.verdicts.paper_metrics import CELL_M, HEIGHT_M

HOW_TO_READ = f"""\
- *Landed*: within the limit of distance from the marker's centre.
- *Violations* are counted by the limits in the column *definition*. Top-10, violating scenarios,
  coverage, causes and kinds are of the same violations. Rows of different definitions are
  not compared.
- *Paper's definition*: a collision, a crash, or no landing within 1.5 m of the marker; each flight
  that gives up counts, because the paper's type II is "no landing occurs".
- *Gave up*: flights that the landing system gave up, for whatever reason. *Blocked*, *excused* and
  *needless* share out the flights that were given up or ran out of time: the marker was never free
  for long enough, it could not be read for long enough, or neither.
- Behind the mean, brackets hold the figure of each seed. There are no intervals: the flights of a
  search that learns are no independent sample.
- *Top-10*: flights until the tenth violation, one figure per seed; – if there were fewer than
  ten. In comparisons and means such a search counts as the budget plus one.
- *Hours*: of one search on its workers, idle time included.
- *Parameter distance*: the mean Euclidean distance between all scenarios of a search (the paper's
  equation), over every gene that all methods have, normalised to [0, 1]; the same for the violating
  scenarios alone; and that of the eight weather genes, not normalised. The paper's code measured
  weather alone, without normalising it, so its figures stand beside that column.
- *Coverage*: the share of cells of {CELL_M:g} m, up to {HEIGHT_M:g} m above the map, that
  violating flights pass through.
- *Causes*: distinct types and causes of violations, such as `IV:dog`, one count per seed.
  *Kinds* are signatures. They distinguish the phase and the sight as well, as in
  `IV:dog:last-metre:unseen`.
- *Effective kinds*: so many equally frequent kinds would be as diverse as those that the search
  found (Hill number of order 1), one figure per seed. All searches have the same number of flights.
- *Kinds at equal violations*: how many kinds the given number of violations shows on average if it
  is drawn from those of a search (rarefaction). The number is that of the search with the fewest
  violations for this system and map, but at least {tables.LEAST_VIOLATIONS}; – for a search with
  fewer.
- *A12* (Vargha and Delaney): how often a search of the first method has the larger figure; 0.5
  means no difference. *p*: exact two-sided Mann-Whitney test over the seeds. Three seeds against
  three cannot reach p below 0.10. *p by Holm* counts all comparisons of effective kinds that the
  table has for the system; the other p stand alone."""


def write_report(
    experiment: Experiment, rows: Sequence[ResultRow], source: str, path: Path
) -> Path:
    """Write the report to ``path``; ``source`` names the rows' file."""
    sections = [
        f"# {experiment.title}",
        "<!-- Written by "
        f"`python -m lab.experiment {experiment.file.name} --report` from {source}: "
        "change remarks in the TOML file, and write it again. -->",
        experiment.text,
        "## What was run",
        *_flown(experiment, rows),
    ]
    for grid in experiment.grids:
        sections += _grid(experiment, grid, rows)
    sections += ["## How to read the tables", HOW_TO_READ]
    return write_text_atomically(path, "\n\n".join(part for part in sections if part) + "\n")


def _flown(experiment: Experiment, rows: Sequence[ResultRow]) -> Iterator[str]:
    own = [
        row
        for grid in experiment.grids
        for each in searches_in_grid(experiment, grid, rows)
        for row in each.rows
    ]
    lines = []
    for grid in experiment.grids:
        found = searches_in_grid(experiment, grid, rows)
        flown, wanted = sum(len(each.rows) for each in found), len(found) * len(grid.seeds)
        seeds = ", ".join(str(seed) for seed in grid.seeds)
        lines.append(
            f"- {grid.name}: {flown} of {wanted} searches of {experiment.budget} flights: "
            f"{', '.join(grid.systems)} on {', '.join(grid.maps)} by {', '.join(grid.methods)}; "
            f"seeds {seeds}; domain {grid.domain}"
        )
    yield "\n".join(lines)
    left = missing_runs(experiment, rows)
    if left:
        yield "Not run:\n\n" + "\n".join(_left(left))
    unique = {row.key: row for row in own}.values()
    if unique:
        yield "Flown with:\n\n" + "\n".join(_identity(unique))
    if len({row.package_sha256 for row in unique}) > 1:
        yield "**These searches are from more than one state of pytest-garl.**"


def _left(runs: Iterable[ExperimentRun]) -> Iterator[str]:
    groups: dict[tuple[str, str, tuple[str, ...]], list[str]] = {}
    for run in runs:
        groups.setdefault((run.system, run.method, run.maps), []).append(str(run.seed))
    for (system, method, maps), seeds in groups.items():
        yield f"- {system}, {method}, on {' and '.join(maps)}: seed {', '.join(seeds)}"


def _identity(rows: Iterable[ResultRow]) -> Iterator[str]:
    """Yield the code, machines and settings of the rows, so that a mixture is visible."""
    facts = [
        Counter(f"pytest-garl {row.version}, sources {row.package_sha256}" for row in rows),
        Counter(f"{row.machine}, {row.engine}, {row.workers} workers" for row in rows),
        Counter(
            f"{row.system}: `{row.landing_system}`, sources {row.landing_system_sha256}"
            for row in rows
        ),
        Counter(f"map {row.map} {row.map_sha256}" for row in rows),
        Counter(f"{row.method}: objects moved by {_policy(row)}" for row in rows),
    ]
    for fact in facts:
        for text, count in sorted(fact.items()):
            yield f"- {text} ({count} search{'es' * (count > 1)})"


def _policy(row: ResultRow) -> str:
    return f"{row.policy} {row.policy_sha256}".strip()


def _grid(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow]) -> list[str]:
    return [
        f"## {grid.title}",
        grid.text,
        tables.effect(experiment, grid, rows),
        tables.diversity(experiment, grid, rows),
        tables.comparison(experiment, grid, rows),
        tables.comparison_of_kinds(experiment, grid, rows),
        grid.remarks,
    ]
