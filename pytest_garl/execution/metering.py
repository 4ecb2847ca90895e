"""Measures the calls of a landing system that is flown in this process, and ends one that hangs."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import process_time
from types import FrameType

HUNG_S = 30.0
"""Wall time of one call after which it is taken for hanging: what a search allows it on its own."""


class OutOfTimeError(Exception):
    """The computing time for all flights is used up."""


class HungError(BaseException):
    """One call of a landing system took too long; `except Exception` does not catch it."""


class Meter:
    """A guard of the landing system's calls: CPU time in all, of the slowest, and on average."""

    def __init__(self, limit_s: float) -> None:
        self._ends_at_s = process_time() + limit_s
        self._began_s = 0.0
        self._calls, self._total_s = 0, 0.0
        self._rings = False
        self.slowest_s = 0.0

    @property
    def mean_s(self) -> float:
        """CPU time of a call."""
        return self._total_s / max(1, self._calls)

    def step_begins(self) -> None:
        """Start the clocks; raise OutOfTimeError where there is no time left."""
        self._began_s = process_time()
        if self._began_s > self._ends_at_s:
            raise OutOfTimeError
        if self._rings:
            # Again and again: a system may catch whatever it is interrupted by.
            signal.setitimer(signal.ITIMER_REAL, HUNG_S, 1.0)

    def step_ends(self) -> None:
        """Stop the clocks."""
        if self._rings:
            signal.setitimer(signal.ITIMER_REAL, 0)
        taken = process_time() - self._began_s
        self._calls += 1
        self._total_s += taken
        self.slowest_s = max(self.slowest_s, taken)

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Interrupt calls that hang, in the main thread, unless the alarm is somebody's."""
        if (
            threading.current_thread() is not threading.main_thread()
            or signal.getsignal(signal.SIGALRM) is not signal.SIG_DFL
        ):
            yield
            return
        signal.signal(signal.SIGALRM, _interrupt)
        self._rings = True
        try:
            yield
        finally:
            self._rings = False
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise HungError(f"one call took longer than {HUNG_S:g} s")
