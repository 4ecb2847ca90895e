"""Begin a run, or join the one that the xdist controller began."""

from __future__ import annotations

import fcntl
import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any, TextIO

import pytest

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.errors import LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.processes import alive
from pytest_garl.execution.ray.pool import check_ray, ray_pool
from pytest_garl.execution.reference import BUILT_IN, package_sha256, reference_to
from pytest_garl.execution.stored_ledger import check_stored
from pytest_garl.plugin.keys import is_xdist_worker
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.run import Run
from pytest_garl.reports.run_report import BEGAN, utc


def begin_run(config: pytest.Config, options: Options) -> Run:
    """Return this process's part of the run; the ledger is made by the first process alone."""
    # Weights that cannot be trusted, or no Ray, end the session before there is a ledger.
    policy_spec(options.npcs)
    if options.pool == "ray":
        check_ray(options.ray_address)
    lock = None
    if not options.searches:
        ledger = _shared(options)
    elif is_xdist_worker(config):
        ledger = Ledger(options.ledger)
    else:
        lock = _lock(options.ledger)
        facts: dict[str, Any] = {
            "version": version("pytest-garl"),
            "sources of pytest-garl": package_sha256()[:12],
            "python": sys.version.split()[0],
            "seed": options.seed,
            "budget": options.budget,
            "method": options.method,
            "population": options.population,
            "map": ",".join(options.maps),
            "weather": options.weather,
            "npcs": options.npcs,
        }
        earlier = _seconds_per_flight(options)
        if options.resume:
            ledger = Ledger.resume(options.ledger, facts)
            check_stored(ledger)
        else:
            ledger = Ledger.create(options.ledger, facts)
            ledger.note_fact(BEGAN, utc())
        if earlier:
            ledger.note_fact("seconds_per_flight", earlier)
    own = config.hook.pytest_garl_fly(config=config)
    run = Run(
        options=options,
        ledger=ledger,
        pool=_pool(ledger, options),
        simulator=reference_to(own) if own else BUILT_IN,
        lock=lock,
    )
    run.flight_s = _or_default(ledger)
    return run


def _pool(ledger: Ledger, options: Options) -> Pool:
    if options.pool == "ray":
        return ray_pool(ledger.queue, options.workers, options.root)
    assert options.workers is not None
    return local_pool(ledger.queue, options.workers)


def _shared(options: Options) -> Ledger:
    """Return the ledger of a run of saved cases, made by whoever of its processes comes first."""
    path = options.ledger
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
    """Remove the ledgers of runs of saved cases that were killed; each has its process's id."""
    for path in folder.glob("cases-*.*"):
        number = path.name.removeprefix("cases-").partition(".")[0]
        if number.isdigit() and not alive(int(number)):
            path.unlink(missing_ok=True)


def _lock(ledger: Path) -> TextIO:
    """Keep other runs out of the folder until the file is closed, or this process is gone."""
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


def _seconds_per_flight(options: Options) -> float | None:
    path = options.folder / "ledger.sqlite"
    if not path.is_file():
        return None
    try:
        ledger = Ledger(path)
        try:
            return ledger.queries.seconds_per_flight()
        finally:
            ledger.close()
    except Exception:  # noqa: BLE001 (an unreadable old ledger only costs the estimate)
        return None


def _or_default(ledger: Ledger) -> float:
    from pytest_garl.plugin.run import FLIGHT_S

    known = ledger.fact("seconds_per_flight")
    return float(known) if isinstance(known, int | float) else FLIGHT_S
