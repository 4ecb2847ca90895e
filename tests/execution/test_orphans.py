"""No child outlives the process that started it, whenever that one is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pytest_garl.execution.processes import alive, named

STARTS_A_CHILD = """
import sys, time
from pathlib import Path
from pytest_garl.execution.process_pool import ProcessPool
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import FlightWorkers

ledger = Ledger.create(Path(sys.argv[1]), {})
pool = ProcessPool(ledger.queue, FlightWorkers(max_workers=1))
pool.turn()
print(*pool._children, flush=True)
time.sleep(600)
"""
PATIENCE_S = 120.0


@pytest.mark.parametrize("after_s", [0.0, 0.05, 0.2, 1.0])
def test_a_child_ends_with_its_parent_however_early_that_is_killed(
    tmp_path: Path, after_s: float
) -> None:
    path = tmp_path / "ledger.sqlite"
    command = [sys.executable, "-c", STARTS_A_CHILD, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        child = int(parent.stdout.readline())
        time.sleep(after_s)
        parent.kill()
    until = time.monotonic() + PATIENCE_S
    # The child's command line has the ledger in it, and so has that of the process that flies.
    while (alive(child) or named(str(path))) and time.monotonic() < until:
        time.sleep(0.02)
    assert not alive(child)
    assert not named(str(path))


def test_a_flying_process_ends_with_its_supervisor(tmp_path: Path) -> None:
    path = tmp_path / "ledger.sqlite"
    command = [sys.executable, "-c", STARTS_A_CHILD, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        supervisor = int(parent.stdout.readline())
        time.sleep(0.5)
        os.kill(supervisor, signal.SIGKILL)
        until = time.monotonic() + PATIENCE_S
        parent.kill()
        while named(str(path)) and time.monotonic() < until:
            time.sleep(0.02)
    assert not named(str(path))


@pytest.mark.parametrize("module", ["worker", "ray.driver"])
def test_a_child_whose_parent_is_another_than_it_was_told_ends_at_once(
    tmp_path: Path, module: str
) -> None:
    """As it is if the parent was killed before the child could ask who it is."""
    code = f"import pytest_garl.execution.{module} as child, sys; child.run_worker(child.main, '')"
    command = [sys.executable, "-c", code, "1", "2", str(tmp_path / "ledger.sqlite"), ".", "1"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, "")
