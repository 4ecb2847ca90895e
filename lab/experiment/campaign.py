"""Fly the runs that an experiment's CSV lacks; an interrupted campaign can be continued."""

from __future__ import annotations

import dataclasses
import functools
import shutil
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from lab.experiment.measure import finished_searches, result_row
from lab.experiment.pytest_run import run_pytest
from lab.experiment.results import ResultRow, append_rows, read_rows
from lab.experiment.spec import Experiment, ExperimentRun
from pytest_garl.errors import ExperimentError, GarlError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.files.atomic import locked
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.method_catalogue import find_method


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignFolders:
    """The CSV file of the rows, the folder of the runs' ledgers and the folder to run pytest in."""

    rows: Path
    runs: Path
    root: Path


def missing_runs(experiment: Experiment, known: Sequence[ResultRow]) -> tuple[ExperimentRun, ...]:
    """Return the runs without a row, each with only the maps without a row."""
    keys = {row.key for row in known}
    found = []
    for run in experiment.runs:
        maps = tuple(
            map
            for map in run.maps
            if (run.system, map, run.method, run.seed, run.budget, run.domain) not in keys
        )
        if maps:
            found.append(dataclasses.replace(run, maps=maps))
    return tuple(found)


def check_experiment(experiment: Experiment, root: Path) -> None:
    """Raise ExperimentError for tests, maps, methods and policies that do not exist."""
    for name, tests in experiment.systems.items():
        if not (root / tests.partition("::")[0]).exists():
            raise ExperimentError(
                f"{experiment.file}: key 'systems.{name}': found {tests!r}, expected tests below "
                f"{root}, as arguments of pytest"
            )
    for run in experiment.runs:
        for key, what, find in (
            ("maps", run.maps, functools.partial(load_map, search_path=(_maps(root),))),
            ("methods", (run.search_method,), _known_method),
            ("methods", (run.npcs,) if run.npcs else (), policy_spec),
            ("domain", (run.domain,), functools.partial(domain_with_policy, folder=root)),
        ):
            for each in what:
                _found(experiment, key, each, find)


def _found(experiment: Experiment, key: str, name: str, find: Callable[[str], object]) -> None:
    try:
        find(name)
    except GarlError as error:
        raise ExperimentError(f"{experiment.file}: key {key!r}: {error}") from error


def _known_method(name: str) -> None:
    # pytest finds a user's "module:factory": only pytest knows where to import from.
    if ":" not in name:
        find_method(name)


def _maps(root: Path) -> Path:
    return root / "scenarios" / "maps"


def fly_experiment(
    experiment: Experiment, folders: CampaignFolders, workers: int, tell: Callable[[str], None]
) -> None:
    """Fly all missing runs, and tell of each; its rows are saved as soon as it is finished."""
    check_experiment(experiment, folders.root)
    total = len(experiment.runs)
    left = missing_runs(experiment, read_rows(folders.rows))
    for run in {*experiment.runs} - {*left}:
        _tidy(folders.runs / run.folder)
    for number, run in enumerate(left, start=total - len(left) + 1):
        folder = folders.runs / run.folder
        tell(f"run {number} of {total}: {run.title}")
        with locked(folder, functools.partial(tell, f"    another process flies it: {folder}")):
            if run in missing_runs(experiment, read_rows(folders.rows)):
                rows = _fly_run(run, folder, workers)
                append_rows(folders.rows, rows)
                for row in rows:
                    tell(
                        f"    {row.map}: {row.landed} of {row.budget} landed, {row.violations} "
                        f"violate, {len(row.signatures)} kinds, Top-10 {row.top10 or 'not reached'}"
                    )
            _tidy(folder)


def _tidy(folder: Path) -> None:
    """Delete the records of flights; the ledger is kept, so that each flight can be repeated."""
    shutil.rmtree(folder / "flights", ignore_errors=True)


def _fly_run(run: ExperimentRun, folder: Path, workers: int) -> list[ResultRow]:
    with closing(Ledger(run_pytest(run, folder, workers))) as ledger:
        return [
            result_row(run, each, ledger, workers=workers)
            for each in finished_searches(run, ledger)
        ]
