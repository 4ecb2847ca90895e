"""Begin a run, or join the one that the xdist controller began."""

from __future__ import annotations

import sys
from importlib.metadata import version
from typing import Any

import pytest

from pytest_garl.options import Options
from pytest_garl.run import Run
from pytest_garl.search.ledger import Ledger
from pytest_garl.search.pool import Pool
from pytest_garl.search.reference import Reference, reference_to

BUILT_IN = Reference(module="pytest_garl.simulation.fly", file="", qualname="fly")


def begin_run(config: pytest.Config, options: Options) -> Run:
    """Return this process's part of the run; the ledger is made by the first process alone."""
    if hasattr(config, "workerinput"):
        ledger = Ledger(options.ledger)
    else:
        facts: dict[str, Any] = {
            "version": version("pytest-garl"),
            "python": sys.version.split()[0],
            "seed": options.seed,
            "budget": options.budget,
            "method": options.method,
            "weather": options.weather,
            "npcs": options.npcs,
        }
        earlier = _seconds_per_flight(options)
        if earlier:
            facts["seconds_per_flight"] = earlier
        ledger = Ledger.create(options.ledger, facts)
    own = config.hook.pytest_garl_fly(config=config)
    run = Run(
        options=options,
        ledger=ledger,
        pool=Pool(ledger, options.workers),
        simulator=reference_to(own) if own else BUILT_IN,
    )
    run.flight_s = _or_default(ledger)
    return run


def _seconds_per_flight(options: Options) -> float | None:
    path = options.folder / "ledger.sqlite"
    if not path.is_file():
        return None
    try:
        ledger = Ledger(path)
        try:
            return ledger.seconds_per_flight()
        finally:
            ledger.close()
    except Exception:  # noqa: BLE001 (an unreadable old ledger only costs the estimate)
        return None


def _or_default(ledger: Ledger) -> float:
    from pytest_garl.run import FLIGHT_S

    known = ledger.fact("seconds_per_flight")
    return FLIGHT_S if known is None else float(known)
