"""Tasks of a judge: one file for each, flown in processes of the lowest priority."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

from lab.table import ResultTable
from pytest_garl.execution.processes import end_with_parent

FOLDER = Path(".garl/judges")
LOWEST_PRIORITY = 19


class Task(Protocol):
    """One search, or one set of flights, whose row does not depend on any other."""

    @property
    def name(self) -> str:
        """The name of its file, and what it is called."""

    @property
    def group(self) -> str:
        """What it shares with the tasks beside it that the same process flies: by default, none."""
        return self.name

    def row(self) -> dict[str, Any]:
        """Fly it in this process; return its row."""


def file_of(folder: Path, task: Task) -> Path:
    """Return the file of a task."""
    return folder / f"{task.name}.json"


def run(tasks: Sequence[Task], folder: Path, pool_of: Callable[[], Executor]) -> int:
    """Fly the tasks that have no file, and tell after each how much time is left.

    Returns how many have no file afterwards.  The pool's processes fly one group each at a time.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = [task for task in tasks if not file_of(folder, task).is_file()]
    print(f"{len(tasks) - len(missing)} of {len(tasks)} are flown, in {folder}", flush=True)
    commit, began = present_commit(), time.monotonic()
    groups = [[*each] for _, each in itertools.groupby(missing, key=lambda task: task.group)]
    with pool_of() as pool:
        flying = {pool.submit(_fly, each, folder, commit): each for each in groups}
        done = 0
        try:
            for future in as_completed(flying):
                group, error = flying[future], future.exception()
                # The other groups are worth hours.
                told = (
                    future.result()
                    if error is None
                    else f"{group[0].group}: {''.join(traceback.format_exception(error))}"
                )
                done += len(group)
                passed_s = time.monotonic() - began
                left_s = passed_s / done * (len(missing) - done)
                print(
                    f"[{done}/{len(missing)}] {told}; "
                    f"{_hours(passed_s)} so far, about {_hours(left_s)} left",
                    flush=True,
                )
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            print("interrupted: the same command continues", flush=True)
    return sum(not file_of(folder, task).is_file() for task in tasks)


def _fly(group: Sequence[Task], folder: Path, commit: str) -> str:
    """Fly tasks up to one that fails, write the file of each, and tell how they went."""
    told = []
    for task in group:
        row = task.row()
        _write(file_of(folder, task), {**row, "commit": commit})
        told.append(f"{task.name}: {row['told']}")
    return "; ".join(told)


def nice_pool(jobs: int) -> Executor:
    """Return processes that let everything else on the machine go first."""
    return ProcessPoolExecutor(
        jobs, mp_context=get_context("spawn"), initializer=be_nice, initargs=(os.getpid(),)
    )


def be_nice(parent: int) -> None:
    """Let everything else on the machine go first, compute with one thread, end with the parent."""
    import cv2

    end_with_parent(parent)
    os.nice(LOWEST_PRIORITY)
    cv2.setNumThreads(1)


def collect(tasks: Iterable[Task], folder: Path, table: ResultTable) -> None:
    """Add the rows of the files to a table that lacks them."""
    known, rows = table.keys(), []
    for task in tasks:
        file = file_of(folder, task)
        if file.is_file():
            row = json.loads(file.read_text())
            if tuple(str(row[name]) for name in table.key) not in known:
                rows.append({name: _cell(row[name]) for name in table.columns})
    if rows:
        table.append(rows, quietly=True)


def present_commit() -> str:
    """Return the commit of the code, with a plus if something is changed; empty without git."""

    def told(*words: str) -> str:
        return subprocess.run(
            ("git", *words), capture_output=True, text=True, check=False
        ).stdout.strip()

    changed = told("status", "--porcelain", "--untracked-files=no")
    return told("rev-parse", "--short=10", "HEAD") + ("+" if changed else "")


def _write(file: Path, row: dict[str, Any]) -> None:
    """Write a file in one step: a file that is there is whole."""
    part = file.with_suffix(".part")
    part.write_text(json.dumps(row, indent=1) + "\n")
    part.replace(file)


def _cell(value: Any) -> str:
    if isinstance(value, list | dict):
        return json.dumps(value)
    return "" if value is None else str(value)


def _hours(seconds: float) -> str:
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
