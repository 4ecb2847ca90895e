"""Workers end if the process that started them is killed, at any moment."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pytest_garl.process_tree import alive, any_command_contains

STARTS_A_WORKER = """
import sys, time
from pathlib import Path
from pytest_garl.execution.local_pool import ProcessPool
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import FlightWorkers

ledger = Ledger.create(Path(sys.argv[1]), {})
pool = ProcessPool(ledger.queue, FlightWorkers(max_workers=1))
pool.turn()
print(*pool._workers, flush=True)
time.sleep(600)
"""
PATIENCE_S = 120.0


@pytest.mark.parametrize("after_s", [0.0, 0.05, 0.2, 1.0])
def test_worker_ends_with_its_parent_however_early_that_is_killed(
    tmp_path: Path, after_s: float
) -> None:
    path = tmp_path / "ledger.sqlite"
    command = [sys.executable, "-c", STARTS_A_WORKER, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        worker = int(parent.stdout.readline())
        time.sleep(after_s)
        parent.kill()
    until = time.monotonic() + PATIENCE_S
    # The command lines of the worker's two processes contain the path of the ledger.
    while (alive(worker) or any_command_contains(str(path))) and time.monotonic() < until:
        time.sleep(0.02)
    assert not alive(worker)
    assert not any_command_contains(str(path))


def test_flying_process_ends_with_its_supervisor(tmp_path: Path) -> None:
    path = tmp_path / "ledger.sqlite"
    command = [sys.executable, "-c", STARTS_A_WORKER, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        supervisor = int(parent.stdout.readline())
        time.sleep(0.5)
        os.kill(supervisor, signal.SIGKILL)
        until = time.monotonic() + PATIENCE_S
        parent.kill()
        while any_command_contains(str(path)) and time.monotonic() < until:
            time.sleep(0.02)
    assert not any_command_contains(str(path))


@pytest.mark.parametrize("module", ["worker", "ray.driver"])
def test_worker_ends_at_once_if_its_parent_has_ended(tmp_path: Path, module: str) -> None:
    """The parent may be killed before the worker asks for its parent's id."""
    code = (
        f"import pytest_garl.execution.{module} as worker, sys; worker.run_worker(worker.main, '')"
    )
    command = [sys.executable, "-c", code, "1", "2", str(tmp_path / "ledger.sqlite"), ".", "1"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, "")
