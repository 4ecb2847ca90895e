"""Measures calls of a landing system that flies in this process, and interrupts one that hangs."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import process_time
from types import FrameType

HUNG_S = 30.0
"""A call hangs if it takes more wall time; a search allows this much if the slot flies alone."""


class OutOfTimeError(Exception):
    """The CPU time for all flights is used up."""


class HungError(BaseException):
    """One call of a landing system took too long; `except Exception` does not catch it."""


class CallMeter:
    """Measures the CPU time of calls, of the slowest and on average, and limits their sum."""

    def __init__(self, limit_s: float) -> None:
        self._ends_at_s = process_time() + limit_s
        self._began_s = 0.0
        self._calls, self._total_s = 0, 0.0
        self._interrupts = False
        self.slowest_s = 0.0

    def allow(self, limit_s: float) -> None:
        """Limit the sum anew, from now on."""
        self._ends_at_s = process_time() + limit_s

    @property
    def mean_s(self) -> float:
        """Mean CPU time of a call."""
        return self._total_s / max(1, self._calls)

    def step_begins(self) -> None:
        """Start the clocks; raise OutOfTimeError if no time is left."""
        self._began_s = process_time()
        if self._began_s > self._ends_at_s:
            raise OutOfTimeError
        if self._interrupts:
            # Repeated every second: a system may catch the first interruption.
            signal.setitimer(signal.ITIMER_REAL, HUNG_S, 1.0)

    def step_ends(self) -> None:
        """Stop the clocks."""
        if self._interrupts:
            signal.setitimer(signal.ITIMER_REAL, 0)
        taken = process_time() - self._began_s
        self._calls += 1
        self._total_s += taken
        self.slowest_s = max(self.slowest_s, taken)

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Interrupt calls that hang, if this is the main thread and SIGALRM has no handler."""
        if (
            threading.current_thread() is not threading.main_thread()
            or signal.getsignal(signal.SIGALRM) is not signal.SIG_DFL
        ):
            yield
            return
        signal.signal(signal.SIGALRM, _interrupt)
        self._interrupts = True
        try:
            yield
        finally:
            self._interrupts = False
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise HungError(f"one call took longer than {HUNG_S:g} s")
