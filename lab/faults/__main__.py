"""Search for planted faults: mutation scores of search methods.

``python -m lab.faults`` runs the searches that ``docs/faults.csv`` lacks; it can be interrupted
and started again at any time.  ``--check`` flies the hand-made scenarios only, ``--report`` prints
the scores.
"""

from __future__ import annotations

import argparse
import itertools
import os

from lab.faults.catalogue import FAULTS, PLACEBO, fault_named
from lab.faults.fault import Fault, finds, result_of
from lab.faults.report import report
from lab.faults.search import TABLE, npcs, search_missing
from lab.table import run_study

SEEDS = (1, 2, 3, 4, 5)
"""Seed 0 was looked at while ``garl`` was developed."""


def check(faults: list[Fault]) -> None:
    """Fly the hand-made scenarios and print what they show; the placebo has none."""
    for fault in faults:
        if fault is PLACEBO:
            continue
        faulty = result_of(fault.faulty, fault.scenario, npcs())
        fires = finds(fault, fault.scenario, npcs(), faulty)
        verdict = faulty.verdict
        good = fires and verdict.violation_type == fault.fires
        print(f"{'ok' if good else 'FAILS'}: {fault.name}: {verdict.signature}: {verdict.story}")


def search(arguments: argparse.Namespace) -> None:
    """Check, or run the searches; all faults come before the next seed."""
    faults = [fault_named(name) for name in arguments.faults]
    if arguments.check:
        check(faults)
        return
    keys = (
        (method, fault.name, str(seed))
        for seed, fault, method in itertools.product(arguments.seeds, faults, arguments.methods)
    )
    search_missing(keys, arguments.flights, arguments.workers)


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--methods", nargs="+", default=["garl", "random"])
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--flights", type=int, default=100, help="of a search; default 100")
    names = [each.name for each in (*FAULTS, PLACEBO)]
    parser.add_argument("--faults", nargs="+", default=names, choices=names, metavar="FAULT")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--check", action="store_true", help="fly the hand-made scenarios only")
    run_study(parser, TABLE, report, search)


if __name__ == "__main__":
    main()
