"""Flies what an experiment's CSV lacks, run by run; interrupted at any time, it goes on."""

from __future__ import annotations

import dataclasses
import functools
import shutil
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.errors import ExperimentError, GarlError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import SearchProgress
from pytest_garl.experiments import results as files
from pytest_garl.experiments.avoidability import pilot
from pytest_garl.experiments.measure import Piloted, row_of, searches_of
from pytest_garl.experiments.pytest_run import search
from pytest_garl.experiments.results import Row
from pytest_garl.experiments.spec import Experiment, Run
from pytest_garl.files.atomic import locked
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.search.catalogue import find_method


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where an experiment's files go: finished rows, and the runs' ledgers.

    ``root`` is where pytest is run.
    """

    rows: Path
    runs: Path
    root: Path


class Watch(Protocol):
    """Is told how far a campaign is."""

    def begins(self, run: Run, number: int, total: int) -> None:
        """Note that a run begins, the ``number``-th of all ``total``, those flown before too."""

    def flies(self, searches: Sequence[SearchProgress]) -> None:
        """Note how far the run is; called often."""

    def pilots(self) -> None:
        """Note that the reference pilot flies what violated; called often."""

    def ended(self, rows: Sequence[Row]) -> None:
        """Note that a run's rows are saved."""


def missing(experiment: Experiment, known: Sequence[Row]) -> tuple[Run, ...]:
    """Return the runs, or those maps of them, that have no row."""
    keys = {row.key for row in known}
    found = []
    for run in experiment.runs:
        maps = tuple(
            map
            for map in run.maps
            if (run.system, map, run.method, run.seed, run.budget) not in keys
        )
        if maps:
            found.append(dataclasses.replace(run, maps=maps))
    return tuple(found)


def check(experiment: Experiment, root: Path) -> None:
    """Raise ExperimentError for what the file names and cannot be flown."""
    for name, tests in experiment.systems.items():
        if not (root / tests.partition("::")[0]).exists():
            raise ExperimentError(
                f"{experiment.file}: key 'systems.{name}': found {tests!r}, expected tests as "
                f"pytest is given them, below {root}"
            )
    for run in experiment.runs:
        for key, what, find in (
            ("maps", run.maps, functools.partial(load_map, search_path=(_maps(root),))),
            ("methods", (run.search,), _known_method),
            ("methods", (run.npcs,) if run.npcs else (), policy_spec),
        ):
            for each in what:
                _found(experiment, key, each, find)


def _found(experiment: Experiment, key: str, name: str, find: Callable[[str], object]) -> None:
    try:
        find(name)
    except GarlError as error:
        raise ExperimentError(f"{experiment.file}: key {key!r}: {error}") from error


def _known_method(name: str) -> None:
    # One's own, "module:factory", is found by pytest, which knows from where to import.
    if ":" not in name:
        find_method(name)


def _maps(root: Path) -> Path:
    return root / "scenarios" / "maps"


def fly(experiment: Experiment, place: Place, workers: int, watch: Watch) -> None:
    """Fly all that is missing; each run's rows are saved as soon as it is finished."""
    check(experiment, place.root)
    total = len(experiment.runs)
    left = missing(experiment, files.read(place.rows))
    for run in {*experiment.runs} - {*left}:
        _tidy(place.runs / run.folder)
    for number, run in enumerate(left, start=total - len(left) + 1):
        folder = place.runs / run.folder
        watch.begins(run, number, total)
        # Another process that flies the same experiment is waited for here.
        with locked(folder):
            if run in missing(experiment, files.read(place.rows)):
                rows = _fly(run, folder, experiment.unavoidable, workers, watch)
                files.append(place.rows, rows)
                watch.ended(rows)
            _tidy(folder)


def _tidy(folder: Path) -> None:
    """Of flights only the figures are kept, and the ledger, from which each can be repeated."""
    shutil.rmtree(folder / "flights", ignore_errors=True)


def _fly(run: Run, folder: Path, pilots: int, workers: int, watch: Watch) -> list[Row]:
    with closing(Ledger(search(run, folder, workers, watch.flies))) as ledger:
        searches = searches_of(run, ledger)
        piloted: Sequence[Piloted | None] = [None] * len(searches)
        if pilots:
            piloted = pilot(
                searches,
                folder / "pilot.sqlite",
                limit=pilots,
                seed=run.seed,
                workers=workers,
                tick=watch.pilots,
            )
        return [
            row_of(run, each, ledger, piloted=tried, workers=workers)
            for each, tried in zip(searches, piloted, strict=True)
        ]
