"""Kill -9 at fifty moments, each resumed: nothing is lost or flown twice, and no orphan stays."""

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
from pytest_garl.execution.processes import any_command_contains, children_of
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
SAVES_SLOWLY = """
import time
from pytest_garl.files import atomic
from pytest_garl.regressions import corpus

write = atomic.write_text_atomically

def slowly(path, text):
    # A kill shall find it between two files, and between a file and its name.
    time.sleep(0.15)
    written = write(path, text)
    time.sleep(0.15)
    return written

corpus.write_text_atomically = slowly
"""
PATIENCE_S = 240.0
RANDOM, STARTING, SAVING = 30, 10, 10
"""Kills at random moments, in a worker's first moments, and while cases are saved."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a run leaves that a user keeps."""

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


def made(folder: Path) -> Path:
    folder.mkdir()
    write_project(folder)
    (folder / "systems.py").write_text(SLOW)
    text = (folder / "test_it.py").read_text().replace("system=Good", "system=Slow")
    (folder / "test_it.py").write_text(text)
    (folder / "conftest.py").write_text(CONFTEST + SAVES_SLOWLY)
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
    folder = made(tmp_path_factory.mktemp("undisturbed") / "project")
    assert start(folder).wait(PATIENCE_S) in (0, 1), (folder / "output.txt").read_text()
    found = outcome(folder)
    assert found.meters["flights"] == BUDGET
    assert len(found.cases) > 1
    return found


class Prey:
    """A run to be killed: its process, and those of its workers."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.process = folder, start(folder)
        self.ledger = folder / ".garl" / "ledger.sqlite"

    def until(self, condition: Callable[[], object]) -> None:
        """Wait until something is so, or the run is over."""
        until = time.monotonic() + PATIENCE_S
        while self.process.poll() is None and not condition():
            assert time.monotonic() < until, (self.folder / "output.txt").read_text()
            time.sleep(0.005)

    def flown(self) -> int:
        """Return how many flights of all kinds are done."""
        found = query(self.ledger, "SELECT count(*) FROM slot WHERE state = 'flown'")
        return found[0][0] if found else 0

    def workers(self) -> list[int]:
        return [pid for (pid,) in query(self.ledger, "SELECT pid FROM worker")]

    def flying(self) -> list[int]:
        return [child for worker in self.workers() for child in children_of(worker)]

    def all(self) -> Iterator[int]:
        """Yield all of them, pytest first."""
        yield self.process.pid
        yield from self.flying()
        yield from self.workers()


def kill(*prey: int) -> None:
    for pid in prey:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def at_random(prey: Prey, rng: random.Random) -> None:
    """Kill pytest, a supervisor, a flying process or all, after so many flights."""
    flights = rng.randrange(BUDGET + 20)
    prey.until(lambda: prey.flown() >= flights)
    time.sleep(rng.uniform(0.0, 0.1))
    victims = rng.choice([[prey.process.pid], prey.workers()[:1], prey.flying()[:1], [*prey.all()]])
    kill(*victims)


def at_a_childs_start(prey: Prey, rng: random.Random) -> None:
    """Kill pytest or a worker when the worker has just been started."""
    if rng.random() < 0.5:
        # The next worker takes the place of one that was killed.
        prey.until(lambda: prey.flown() > 2)
        before = prey.workers()
        kill(*prey.flying()[:1])
        prey.until(lambda: set(prey.workers()) - set(before))
    else:
        prey.until(prey.workers)
    time.sleep(rng.choice([0.0, 0.05, 0.2, 0.4]))
    kill(rng.choice([prey.process.pid, prey.process.pid, *prey.workers()]))


def while_saving(prey: Prey, rng: random.Random) -> None:
    """Kill pytest between two cases, or while one is written."""
    prey.until(lambda: "confirming" in (prey.folder / "output.txt").read_text())
    prey.until(lambda: [*prey.folder.glob("scenarios/regressions/*")])
    time.sleep(rng.uniform(0.0, 0.6))
    kill(prey.process.pid)


KILLS = [at_random] * RANDOM + [at_a_childs_start] * STARTING + [while_saving] * SAVING


@pytest.mark.long
@pytest.mark.parametrize("number", range(len(KILLS)))
def test_killed_run_resumes_with_the_same_results(
    tmp_path: Path, undisturbed: Outcome, number: int
) -> None:
    prey = Prey(made(tmp_path / "project"))
    KILLS[number](prey, random.Random(number))
    # A killed worker does not end the run: its slot is flown once more.
    killed = prey.process.wait(PATIENCE_S) == -signal.SIGKILL
    before = query(
        prey.ledger, "SELECT search, generation, slot, sha256 FROM slot WHERE state = 'flown'"
    )
    until = time.monotonic() + PATIENCE_S
    while any_command_contains(str(prey.folder)) and time.monotonic() < until:
        time.sleep(0.02)
    assert not any_command_contains(str(prey.folder)), "orphans"
    cut_short = bool(before) and outcome(prey.folder) != undisturbed
    begun = bool(query(prey.ledger, "SELECT * FROM run WHERE key = 'ledger'"))
    resumed = start(prey.folder, *(["--garl-resume"] if begun else []))
    told = prey.folder / "output.txt"
    assert resumed.wait(PATIENCE_S) in (0, 1), told.read_text()
    left = [path.name for path in (prey.folder / "scenarios").rglob(".*")]
    left += [path.name for path in (prey.folder / ".garl").glob("*-wal")]
    left += [path.name for path in (prey.folder / ".garl").glob("*-shm")]
    assert left == []
    assert outcome(prey.folder) == undisturbed, told.read_text()
    after = query(
        prey.ledger, "SELECT search, generation, slot, sha256 FROM slot WHERE state = 'flown'"
    )
    assert set(before) <= set(after)
    sys.stderr.write(f"\nkill {number}: pytest killed {killed}, cut short {cut_short}\n")
