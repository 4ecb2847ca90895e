"""Kill a run at fifty moments and resume it: no flight is lost or repeated, no process remains."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.process_tree import any_command_contains, children_of
from tests.plugin.test_resume import SLOW, query
from tests.support.landing_project import CONFTEST, write_project

BUDGET = 24
ARGS = (
    f"--garl-budget={BUDGET}",
    "--garl-shrink=10",
    "--garl-population=6",
    "--garl-workers=2",
    "--garl-map=lawn",
)
SLOW_SAVING = """
import time
from pytest_garl.files import atomic
from pytest_garl.cases import corpus

write = atomic.write_text_atomically

def write_slowly(path, text):
    # So that a kill can hit between two files, and between a file and its renaming.
    time.sleep(0.15)
    written = write(path, text)
    time.sleep(0.15)
    return written

corpus.write_text_atomically = write_slowly
"""
PATIENCE_S = 240.0
RANDOM_KILLS, START_KILLS, SAVING_KILLS = 30, 10, 10
"""Numbers of kills at random moments, while a worker starts, and while cases are saved."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The results of a run that a user keeps."""

    hash: str
    cases: dict[str, bytes]
    meters: dict[str, float]


def outcome(folder: Path) -> Outcome:
    ledger = Ledger(folder / ".garl" / "ledger.sqlite")
    meters = {name: ledger.queries.meters().get(name, 0.0) for name in ("flights", "on_demand")}
    found = Outcome(
        hash=ledger.queries.result_hash(),
        cases={path.name: path.read_bytes() for path in folder.glob("scenarios/**/*.toml")},
        meters=meters,
    )
    ledger.close()
    return found


def slow_project(folder: Path) -> Path:
    folder.mkdir()
    write_project(folder)
    (folder / "systems.py").write_text(SLOW)
    text = (folder / "test_it.py").read_text().replace("system=Good", "system=Slow")
    (folder / "test_it.py").write_text(text)
    (folder / "conftest.py").write_text(CONFTEST + SLOW_SAVING)
    return folder


def start(folder: Path, *args: str) -> subprocess.Popen[bytes]:
    with (folder / "output.txt").open("ab") as output:
        return subprocess.Popen(
            [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *ARGS, *args],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    folder = slow_project(tmp_path_factory.mktemp("undisturbed") / "project")
    assert start(folder).wait(PATIENCE_S) in (0, 1), (folder / "output.txt").read_text()
    found = outcome(folder)
    assert found.meters["flights"] == BUDGET
    assert len(found.cases) > 1
    return found


class KillableRun:
    """A started run, with the ids of its processes."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.process = folder, start(folder)
        self.ledger = folder / ".garl" / "ledger.sqlite"

    def wait_until(self, condition: Callable[[], object]) -> None:
        """Wait until a condition holds or the run is over."""
        until = time.monotonic() + PATIENCE_S
        while self.process.poll() is None and not condition():
            assert time.monotonic() < until, (self.folder / "output.txt").read_text()
            time.sleep(0.005)

    def count_flown(self) -> int:
        """Return how many flights of all kinds are done."""
        found = query(self.ledger, "SELECT count(*) FROM slot WHERE state = 'flown'")
        return found[0][0] if found else 0

    def workers(self) -> list[int]:
        return [pid for (pid,) in query(self.ledger, "SELECT pid FROM worker")]

    def flying_processes(self) -> list[int]:
        return [child for worker in self.workers() for child in children_of(worker)]

    def all_processes(self) -> Iterator[int]:
        """Yield the ids of all processes, pytest first."""
        yield self.process.pid
        yield from self.flying_processes()
        yield from self.workers()


def kill(*pids: int) -> None:
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def kill_at_random(run: KillableRun, rng: random.Random) -> None:
    """Kill pytest, a supervisor, a flying process or all, after a random number of flights."""
    flights = rng.randrange(BUDGET + 20)
    run.wait_until(lambda: run.count_flown() >= flights)
    time.sleep(rng.uniform(0.0, 0.1))
    victims = rng.choice(
        [[run.process.pid], run.workers()[:1], run.flying_processes()[:1], [*run.all_processes()]]
    )
    kill(*victims)


def kill_at_worker_start(run: KillableRun, rng: random.Random) -> None:
    """Kill pytest or a worker when the worker has just been started."""
    if rng.random() < 0.5:
        # The next worker takes the place of one that was killed.
        run.wait_until(lambda: run.count_flown() > 2)
        before = run.workers()
        kill(*run.flying_processes()[:1])
        run.wait_until(lambda: set(run.workers()) - set(before))
    else:
        run.wait_until(run.workers)
    time.sleep(rng.choice([0.0, 0.05, 0.2, 0.4]))
    kill(rng.choice([run.process.pid, run.process.pid, *run.workers()]))


def kill_while_saving(run: KillableRun, rng: random.Random) -> None:
    """Kill pytest between two cases, or while one is written."""
    run.wait_until(lambda: "confirming" in (run.folder / "output.txt").read_text())
    run.wait_until(lambda: [*run.folder.glob("scenarios/regressions/*")])
    time.sleep(rng.uniform(0.0, 0.6))
    kill(run.process.pid)


KILL_FUNCTIONS = (
    [kill_at_random] * RANDOM_KILLS
    + [kill_at_worker_start] * START_KILLS
    + [kill_while_saving] * SAVING_KILLS
)


@pytest.mark.long
@pytest.mark.parametrize("number", range(len(KILL_FUNCTIONS)))
def test_killed_run_resumes_with_the_same_results(
    tmp_path: Path, undisturbed: Outcome, number: int
) -> None:
    run = KillableRun(slow_project(tmp_path / "project"))
    KILL_FUNCTIONS[number](run, random.Random(number))
    # A killed worker does not end the run: its slot is flown once more.
    killed = run.process.wait(PATIENCE_S) == -signal.SIGKILL
    before = query(
        run.ledger, "SELECT search, generation, slot, sha256 FROM slot WHERE state = 'flown'"
    )
    until = time.monotonic() + PATIENCE_S
    while any_command_contains(str(run.folder)) and time.monotonic() < until:
        time.sleep(0.02)
    assert not any_command_contains(str(run.folder)), "orphaned processes"
    cut_short = bool(before) and outcome(run.folder) != undisturbed
    has_ledger = bool(query(run.ledger, "SELECT * FROM run WHERE key = 'ledger'"))
    resumed = start(run.folder, *(["--garl-resume"] if has_ledger else []))
    output = run.folder / "output.txt"
    assert resumed.wait(PATIENCE_S) in (0, 1), output.read_text()
    temporary_files = [path.name for path in (run.folder / "scenarios").rglob(".*")]
    temporary_files += [path.name for path in (run.folder / ".garl").glob("*-wal")]
    temporary_files += [path.name for path in (run.folder / ".garl").glob("*-shm")]
    assert temporary_files == []
    assert outcome(run.folder) == undisturbed, output.read_text()
    after = query(
        run.ledger, "SELECT search, generation, slot, sha256 FROM slot WHERE state = 'flown'"
    )
    assert set(before) <= set(after)
    sys.stderr.write(f"\nkill {number}: pytest killed {killed}, cut short {cut_short}\n")
