"""Fly a judge, or print its tables.

    python -m lab.judges faults --jobs=2          # or causes, or preventable
    python -m lab.judges faults --missed          # 400 flights for what garl and exploring+ missed
    python -m lab.judges faults --report

A judge flies what has no file in its folder, each search in one process of the lowest priority; it
can be interrupted and started again.  ``--report`` adds the finished files to the judge's table in
``docs`` and prints what follows from the table.  The definitions are in ``lab/judges/__init__.py``;
with other seeds than those name the table must be another one, too.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

from lab.arms import FROZEN
from lab.faults.catalogue import FAULTS, PLACEBO
from lab.judges import causes, faults, preventable
from lab.judges.flights import LANDINGS, SYSTEMS
from lab.judges.tasks import FOLDER, Task, collect, nice_pool, run
from lab.table import ResultTable

JUDGES: dict[str, ModuleType] = {
    "faults": faults,
    "causes": causes,
    "preventable": preventable,
}
SUBJECTS = {
    "faults": tuple(each.name for each in (*FAULTS, PLACEBO)),
    "causes": tuple(SYSTEMS),
    "preventable": tuple(SYSTEMS),
}
CHOICES = SUBJECTS | {"causes": (*SYSTEMS, *LANDINGS)}


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    judges = parser.add_subparsers(dest="judge", required=True)
    for name, judge in JUDGES.items():
        each = judges.add_parser(name)
        each.add_argument("--arms", nargs="+", default=list(judge.ARMS))
        each.add_argument("--seeds", nargs="+", type=int, default=list(judge.SEEDS))
        each.add_argument(
            "--on", nargs="+", default=SUBJECTS[name], choices=CHOICES[name], metavar="NAME"
        )
        each.add_argument("--flights", type=int, default=judge.FLIGHTS)
        each.add_argument("--jobs", type=int, default=2, help="processes; default 2")
        each.add_argument("--folder", type=Path, default=FOLDER / name)
        each.add_argument("--table", type=Path, default=judge.TABLE.file)
        each.add_argument("--report", action="store_true", help="print the tables, fly nothing")
        if name == "faults":
            each.add_argument(
                "--missed", action="store_true", help="fly what was missed for longer"
            )
    named = parser.parse_args()
    judge = JUDGES[named.judge]
    table = dataclasses.replace(judge.TABLE, file=named.table)
    tasks = tasks_of(judge, named, table)
    if named.report:
        collect(tasks, named.folder, table)
        print(judge.report([row for row in table.rows() if int(row["seed"]) in named.seeds]))
        return
    if judge is causes and FROZEN in named.arms:
        causes.make_work_tree()
    left = run(tasks, named.folder, lambda: nice_pool(named.jobs))
    if left:
        sys.exit(f"{left} searches have no result; the same command flies them again")


def tasks_of(judge: ModuleType, named: argparse.Namespace, table: ResultTable) -> Sequence[Task]:
    """Return the tasks that the command line names."""
    wanted: Callable[..., Sequence[Task]] = judge.tasks
    found = wanted(named.arms, named.on, named.seeds, named.flights)
    if judge is not faults or not (named.missed or named.report):
        return found
    collect(found, named.folder, table)
    seeds = {*faults.MORE_SEEDS, *named.seeds} - {*faults.SEEDS[len(faults.MORE_SEEDS) :]}
    longer = faults.missed(table.rows(), faults.MORE_ARMS, seeds)
    return longer if named.missed else [*found, *longer]


if __name__ == "__main__":
    main()
