"""Begin a run, or join the run of xdist's controller."""

from __future__ import annotations

import fcntl
import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import pytest

from pytest_garl.engine import chosen
from pytest_garl.errors import GarlError, LedgerError
from pytest_garl.execution.facts import Facts
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.ray.ray_pool import check_ray, ray_pool
from pytest_garl.execution.reference import BUILT_IN, package_sha256, reference_to
from pytest_garl.execution.stored_ledger import check_stored, stored_flight_s
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.plugin.items.collection import corpus_of
from pytest_garl.plugin.items.keys import RUN
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.termination import interrupt_on_sigterm
from pytest_garl.plugin.xdist import is_xdist_worker
from pytest_garl.process_tree import alive
from pytest_garl.scenarios.use_file import read_use
from pytest_garl.search.archive import Archive, read_archive

if TYPE_CHECKING:
    from pytest_garl.triage.investigation_queue import Investigations


def begin_run(config: pytest.Config, options: Options) -> None:
    """Begin this process's part of the run and keep it in the stash.

    The first process alone makes the ledger.  Raises UsageError if nothing can be flown.
    """
    try:
        # No physics engine, or weights that cannot be trusted, or no Ray, end the session before
        # there is a ledger.
        chosen()
        policy_spec(options.policy_in(options.domain))
        if options.pool == "ray":
            check_ray(options.ray_address)
        ledger, lock = _open_ledger(config, options)
        own = config.hook.pytest_garl_fly(config=config)
        pool = _pool(ledger, options)
        config.stash[RUN] = Run(
            options=options,
            ledger=ledger,
            pool=pool,
            investigations=_investigations(config, options, ledger, pool),
            simulator=reference_to(own) if own else BUILT_IN,
            corpus=corpus_of(config, options),
            archive=_archive(ledger, options),
            lock=lock,
            flight_s=ledger.facts.earlier_flight_s,
        )
        interrupt_on_sigterm(config)
    except GarlError as error:
        raise pytest.UsageError(str(error)) from error


def join_workers(config: pytest.Config, options: Options) -> None:
    """Open the ledger of the saved cases that xdist's workers flew, for the controller."""
    if not options.searches_or_repeats and _ledger_file(options).is_file():
        begin_run(config, options)


def _open_ledger(config: pytest.Config, options: Options) -> tuple[Ledger, TextIO | None]:
    """Return the run's ledger, and the lock of the process that made it for a search."""
    path = _ledger_file(options)
    if not options.searches_or_repeats:
        return _shared_ledger(path), None
    if is_xdist_worker(config):
        return Ledger(path), None
    lock = _lock(path)
    # The earlier ledger makes room for the new one.
    earlier_s = stored_flight_s(options.search_ledger)
    if options.resume:
        facts = _facts(options)
        if options.archive is not None:
            # The file may have changed since: the run goes on with what its ledger names.
            del facts["archive"]
        ledger = Ledger.resume(path, facts)
        check_stored(ledger)
    else:
        ledger = Ledger.create(path, _facts(options, _keep_archive(options)))
        ledger.facts.note_began()
    if earlier_s:
        ledger.facts.note_earlier_flight_s(earlier_s)
    return ledger, lock


def _ledger_file(options: Options) -> Path:
    """Return the file of the run's ledger.

    A repeated scenario has a ledger of its own and leaves the search's unchanged.  Runs of saved
    cases only may overlap: each has its own ledger and removes it at the end.
    """
    if not options.searches_or_repeats:
        return options.folder / f"cases-{options.controller}.sqlite"
    return options.repeat_ledger if options.repeat else options.search_ledger


def _keep_archive(options: Options) -> str | None:
    """Copy the archive beside the ledger, so that the run can be resumed; return its hash."""
    for path in options.folder.glob(options.archive_named("*").name):
        path.unlink(missing_ok=True)
    if options.archive is None or options.repeat or not options.archive.exists():
        return None
    archive = read_archive(options.archive)
    archive.save(options.archive_named(archive.sha256))
    return archive.sha256


def _archive(ledger: Ledger, options: Options) -> Archive:
    """Return the archive that the ledger names."""
    name = ledger.facts.archive
    if name is None:
        return Archive()
    path = options.archive_named(name)
    found = read_archive(path) if path.exists() else Archive()
    if found.sha256 != name:
        raise LedgerError(
            f"{path}: the archive {name} that this run began with is not there; run without "
            "--garl-resume to begin anew"
        )
    return found


def _facts(options: Options, archive: str | None = None) -> dict[str, Any]:
    """Return the facts that must be equal when the run is resumed."""
    return Facts.that_identify(
        version=version("pytest-garl"),
        package_sha256=package_sha256()[:12],
        python=sys.version.split()[0],
        engine=chosen(),
        seed=options.seed,
        budget=options.budget,
        # A scenario that is flown again belongs to no search.
        method=None if options.repeat else options.method,
        population=options.population,
        map=",".join(options.maps),
        domain=options.domain.label,
        npcs=options.policy_in(options.domain),
        archive=archive,
        use=read_use(options.use).sha256 if options.use else None,
    )


def _pool(ledger: Ledger, options: Options) -> Pool:
    if options.pool == "ray":
        return ray_pool(ledger.queue, options.workers, options.root)
    assert options.workers is not None
    return local_pool(ledger.queue, options.workers)


def _investigations(
    config: pytest.Config, options: Options, ledger: Ledger, pool: Pool
) -> Investigations | None:
    """Return the investigations of a search, in the process that saves cases; else None."""
    if is_xdist_worker(config) or not options.budget or options.repeat or not options.shrink:
        return None
    # Only a search needs Hypothesis, which shrinks.
    from pytest_garl.triage.allowance import ShrinkBudget
    from pytest_garl.triage.investigation_queue import Investigations

    shrinking = ShrinkBudget(each=options.shrink, capped=options.shrink_capped)
    return Investigations(ledger, pool, corpus_of(config, options), shrinking, options.workers or 1)


def _shared_ledger(path: Path) -> Ledger:
    """Return the ledger of a run of saved cases; its first process makes the file."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_stale(path.parent)
        with path.with_suffix(".lock").open("a") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            if path.is_file():
                return Ledger(path)
            return Ledger.create(path, {"version": version("pytest-garl")})
    except OSError as error:
        raise LedgerError(
            f"{path}: cannot be written ({error}); choose another folder with the ini key garl_dir"
        ) from error


def _remove_stale(folder: Path) -> None:
    """Remove ledgers of saved cases whose process, named in the file, is gone."""
    for path in folder.glob("cases-*.*"):
        number = path.name.removeprefix("cases-").partition(".")[0]
        if number.isdigit() and not alive(int(number)):
            path.unlink(missing_ok=True)


def _lock(ledger: Path) -> TextIO:
    """Lock the folder against other runs until the file is closed or this process ends."""
    path = ledger.with_suffix(".lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("a+", encoding="utf-8")
    except OSError as error:
        raise LedgerError(
            f"{ledger}: cannot be written ({error}); choose another folder with the ini key "
            "garl_dir"
        ) from error
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        file.seek(0)
        owner = file.read().strip() or "unknown"
        file.close()
        raise LedgerError(
            f"{ledger}: another run is using this folder (process {owner}); wait for it, or choose "
            "another folder with the ini key garl_dir"
        ) from error
    file.truncate(0)
    file.write(str(os.getpid()))
    file.flush()
    return file
