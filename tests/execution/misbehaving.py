"""Landing systems that harm the process in which they fly, for the stand-in simulator."""

from __future__ import annotations

import ctypes
import faulthandler
import os
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.landing_system import Land, Observation
from tests.execution.flying import Good

kept: list[Any] = []
MARKED = "PYTEST_GARL_TEST_LEFT"
"""In the environment of the processes that are left: who looks for them finds his own only."""


def left(number: str) -> set[int]:
    """Return the processes that flights left which have this number in their environment."""
    found = set()
    for file in Path("/proc").glob("[0-9]*/environ"):
        try:
            if f"{MARKED}={number}".encode() in file.read_bytes():
                found.add(int(file.parent.name))
        except OSError:
            continue
    return found


class HoldsTheLock(Good):
    """Hangs in C code that never lets Python's other threads run."""

    def step(self, observation: Observation) -> Land:
        ctypes.PyDLL(None).sleep(3600)
        return Land()


class StopsClocks(Good):
    """Takes the watch apart, as far as it knows how, and hangs."""

    def step(self, observation: Observation) -> Land:
        faulthandler.cancel_dump_traceback_later()
        faulthandler.unregister(signal.SIGRTMAX)
        signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        hang = time.sleep
        time.time = time.monotonic = lambda: 0.0
        time.sleep = lambda _: None
        while True:
            hang(60)


class LeavesLock(Good):
    """Leaves a thread that holds the interpreter for ever, once its own call is over."""

    def step(self, observation: Observation) -> Land:
        import threading

        threading.Thread(target=ctypes.PyDLL(None).sleep, args=(3600,), daemon=True).start()
        return Land()


class LeavesProcesses(Good):
    """Leaves processes: in its session, in one of their own, and with a parent that is gone."""

    def step(self, observation: Observation) -> Land:
        sleep = [sys.executable, "-c", "import time; time.sleep(600)"]
        environment = {**os.environ, MARKED: Path(__file__).name}
        subprocess.Popen(sleep, env=environment)
        subprocess.Popen(sleep, env=environment, start_new_session=True)
        subprocess.Popen(["setsid", "sh", "-c", "sleep 600 & sleep 600 &"], env=environment).wait()
        return Land()


class StopsItsSupervisor(Good):
    """Stops the process that watches it."""

    def step(self, observation: Observation) -> Land:
        os.kill(os.getppid(), signal.SIGSTOP)
        return Land()


HOLDS = """
import sqlite3, sys, time
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute("BEGIN IMMEDIATE")
print("held", flush=True)
time.sleep(600)
"""


class LeavesTheLedgerLocked(Good):
    """Leaves a process in a session of its own that may write in the ledger, alone."""

    def step(self, observation: Observation) -> Land:
        process = subprocess.Popen(
            [sys.executable, "-c", HOLDS, "ledger.sqlite"],
            start_new_session=True,
            stdout=subprocess.PIPE,
        )
        assert process.stdout
        process.stdout.readline()
        kept.append(process)
        return Land()


class KeepsTheLedgerLocked(Good):
    """Keeps the lock itself, in the flying process."""

    def step(self, observation: Observation) -> Land:
        connection = sqlite3.connect("ledger.sqlite", isolation_level=None)
        connection.execute("BEGIN IMMEDIATE")
        kept.append(connection)
        return Land()


class Forks(Good):
    """Comes back from its call in two processes."""

    def step(self, observation: Observation) -> Land:
        os.fork()
        return Land()


class ClosesFiles(Good):
    """Closes all files that it did not open."""

    def step(self, observation: Observation) -> Land:
        os.closerange(0, 1024)
        return Land()


class OpensNothing(Good):
    """Lets nobody open a file."""

    def step(self, observation: Observation) -> Land:
        _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (3, most))
        return Land()


class ReplacesZeros(Good):
    """Takes a function away that the simulator needs."""

    def step(self, observation: Observation) -> Land:
        setattr(np, "zeros", None)  # noqa: B010 (mypy knows that nobody may)
        return Land()


class PretendsToZeros(Good):
    """Changes what the simulator computes, for itself and for whoever flies after it."""

    def step(self, observation: Observation) -> Land:
        setattr(np, "zeros", np.ones)  # noqa: B010
        return Land()


class SavesNothing(Good):
    """Takes away what writes the record."""

    def step(self, observation: Observation) -> Land:
        vars(np)["savez_compressed"] = lambda *_, **more: None
        return Land()


class OpensNoDatabase(Good):
    """Takes away what opens the ledger."""

    def step(self, observation: Observation) -> Land:
        vars(sqlite3)["connect"] = None
        return Land()


class Floods(Good):
    """Says 200 MB."""

    def step(self, observation: Observation) -> Land:
        for _ in range(200):
            os.write(1, b"y" * 2**20)
            os.write(2, b"x" * 2**20)
        return Land()


class Pretends(Good):
    """Says what a child says that cannot go on, with its exit status."""

    def step(self, observation: Observation) -> Land:
        sys.stderr.write("garl cannot go on: the disk is full")
        sys.stderr.flush()
        os._exit(86)


class WillNotEnd(Good):
    """Ignores the request to end."""

    def step(self, observation: Observation) -> Land:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        return Land()


class DiesOnce(Good):
    """Ends its process by a wrong address, in the first flight of all."""

    def step(self, observation: Observation) -> Land:
        if not Path("died").exists():
            Path("died").touch()
            ctypes.string_at(0)
        return Land()


class KilledOnce(Good):
    """Is ended as the kernel ends a process when there is no memory, in the first flight of all."""

    def step(self, observation: Observation) -> Land:
        if not Path("killed").exists():
            Path("killed").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return Land()
