"""Run a script that never returns, in lock-step with the camera frames.

The script runs in a thread of its own, and only while the landing system's ``step`` waits for it.
Its clock is the flight's.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from types import SimpleNamespace

TICK_S = 1e-6
"""Two readings of a clock are never equal: scripts divide by their difference."""
STOP_S = 2.0
"""How long a script may take to end when the flight is over."""


class ScriptStopped(BaseException):
    """Ends the script's thread; no ``except Exception`` of the script catches it."""


class Clock:
    """The time of the flight as ``time.time`` and ``time.monotonic`` tell it."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def set(self, time_s: float) -> None:
        """Move on to a time; never back."""
        self._now_s = max(self._now_s, time_s)

    def time(self) -> float:
        """Return the time in seconds, each time a little later."""
        self._now_s += TICK_S
        return self._now_s


class Script:
    """A script that waits for frames by calling ``wait`` or ``sleep``."""

    def __init__(self, main: Callable[[], object]) -> None:
        self._main = main
        self.clock = Clock()
        self.time_module = SimpleNamespace(time=self.clock.time, sleep=self.sleep)
        """What the script gets for its ``import time``."""
        self._turn, self._done = threading.Semaphore(0), threading.Semaphore(0)
        self._error: BaseException | None = None
        self._fresh = self._stopped = self.ended = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def resume(self, time_s: float) -> None:
        """Let the script run until it wants the next frame; raise what it raised."""
        if self.ended:
            return
        self.clock.set(time_s)
        self._fresh = True
        if self._thread.ident is None:
            self._thread.start()
        else:
            self._turn.release()
        self._done.acquire()
        if self._error is not None:
            raise self._error

    def wait(self) -> None:
        """Wait, in the script's thread, for a frame that no earlier call has returned for."""
        while not self._fresh:
            self._done.release()
            self._turn.acquire()
            if self._stopped:
                raise ScriptStopped
        self._fresh = False

    def sleep(self, seconds: float) -> None:
        """Let frames pass until a time is over."""
        until = self.clock.time() + seconds
        while self.clock.time() < until:
            self.wait()

    def close(self) -> None:
        """End the script's thread."""
        if self._thread.is_alive():
            self._stopped = True
            self._turn.release()
            self._thread.join(STOP_S)

    def _run(self) -> None:
        try:
            self._main()
        except ScriptStopped:
            return
        except BaseException as error:  # noqa: BLE001 (step raises it: it is a finding)
            self._error = error
        self.ended = True
        self._done.release()
