"""Processes and threads that are started and left, files and limits that are taken away."""

from __future__ import annotations

import atexit
import multiprocessing
import os
import resource
import signal
import subprocess
import threading
import time
from typing import Any, ClassVar

from pytest_garl.landing_system import Observation
from tests.misbehaving.base import Harmless, Misbehaves

LONG_S = "100000.25"
"""How long what is left behind would sleep; by this the test finds it."""
SLEEP = ["sleep", LONG_S]


class LeavesAProcess(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        subprocess.Popen(SLEEP)


class LeavesAProcessInAnotherSession(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        subprocess.Popen(SLEEP, start_new_session=True)


class LeavesADaemon(Harmless):
    """Forks twice, so that the parent of what is left is gone."""

    def misbehave(self, observation: Observation) -> Any:
        if os.fork() == 0:
            os.setsid()
            if os.fork() == 0:
                os.execvp("sleep", SLEEP)
            os._exit(0)


class LeavesTwentyForks(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        for _ in range(20):
            if os.fork() == 0:
                os.execvp("sleep", SLEEP)


class ForksAndFliesOn(Misbehaves):
    """Two processes come back from the call."""

    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        os.fork()


class ForksAndTheParentExits(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        if os.fork():
            os._exit(0)


def _sleep() -> None:
    time.sleep(float(LONG_S))


class LeavesAWorkerOfMultiprocessing(Harmless):
    """Python waits at its end for a worker that is no daemon."""

    def misbehave(self, observation: Observation) -> Any:
        multiprocessing.get_context("fork").Process(target=_sleep).start()


class LeavesThreads(Harmless):
    """Python waits at its end for threads that are no daemons."""

    def misbehave(self, observation: Observation) -> Any:
        for _ in range(50):
            threading.Thread(target=_sleep).start()


class ExitsLater(Misbehaves):
    """A thread ends the process when this flight is over, or the next one begins."""

    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        threading.Timer(0.5, os._exit, (3,)).start()


class CrashesLater(Misbehaves):
    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        signal.setitimer(signal.ITIMER_REAL, 0.5)


class HangsAtTheEnd(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        atexit.register(_sleep)


class ClosesFiles(Misbehaves):
    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        os.closerange(3, 4096)


class ClosesAllFiles(Misbehaves):
    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        os.closerange(0, 4096)


class RedirectsStderr(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


class MayOpenNothing(Misbehaves):
    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))


class MayWriteNothing(Misbehaves):
    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


class MayComputeNoMore(Misbehaves):
    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        used = int(time.process_time()) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (used, used))


class MayAllocateNothing(Misbehaves):
    comes_to = "either"

    def misbehave(self, observation: Observation) -> Any:
        size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()  # noqa: SIM115, PTH123 (a landing system like many)
        resource.setrlimit(resource.RLIMIT_AS, (size, size))


class LeaksFiles(Harmless):
    kept: ClassVar[list[Any]] = []

    def misbehave(self, observation: Observation) -> Any:
        self.kept.extend(os.open(os.devnull, os.O_RDONLY) for _ in range(900))


class LeaksAllFiles(Misbehaves):
    comes_to = "either"
    kept: ClassVar[list[Any]] = []

    def misbehave(self, observation: Observation) -> Any:
        try:
            while True:
                self.kept.append(os.open(os.devnull, os.O_RDONLY))
        except OSError:
            pass


class LeaksMemory(Harmless):
    kept: ClassVar[list[Any]] = []

    def misbehave(self, observation: Observation) -> Any:
        self.kept.append(bytearray(200_000_000))


class KeepsObservations(Harmless):
    needs_camera = True
    kept: ClassVar[list[Any]] = []

    def misbehave(self, observation: Observation) -> Any:
        self.kept.append((observation, observation.image))
