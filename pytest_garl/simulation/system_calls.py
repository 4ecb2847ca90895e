"""Calls of the landing system's code, and what is recorded where it breaks down."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from pytest_garl.simulation.flight import Crash

_OURS = {Path(__file__), Path(__file__).with_name("loop.py")}
"""Whose lines are no part of a landing system's traceback."""


class StepGuard(Protocol):
    """Told before and after each call of the landing system's code; the pool's watchdog."""

    def step_begins(self) -> None:
        """User code is about to run."""

    def step_ends(self) -> None:
        """User code has returned or raised."""


class BrokenError(Exception):
    """The landing system broke down; carries what the flight records."""

    def __init__(self, crash: Crash) -> None:
        self.crash = crash


class SystemCalls:
    """Calls a landing system under a guard; whatever it raises becomes a BrokenError."""

    def __init__(self, system: Callable[[], Any], guard: StepGuard | None) -> None:
        self._name = getattr(system, "__name__", "system")
        self._guard = guard

    def ask(self, method: str, call: Callable[[], Any]) -> Any:
        """Return what ``call``, of the system's ``method``, returns."""
        if self._guard:
            self._guard.step_begins()
        try:
            return call()
        except Exception as error:
            # Not ours to name: whatever a landing system raises is how it fails, and a finding.
            raise BrokenError(crash_of(error, method)) from error
        finally:
            if self._guard:
                self._guard.step_ends()

    def refuse(self, problem: str | None, method: str) -> None:
        """End the flight where there is a problem with what ``method`` returned."""
        if problem:
            raise BrokenError(
                Crash(
                    kind="nonsense",
                    error="BadCommand",
                    message=problem,
                    where=f"{self._name}.{method}",
                    traceback="",
                )
            )


def crash_of(error: Exception, method: str) -> Crash:
    """Return the record of what a landing system raised in one of its methods."""
    frames = traceback.extract_tb(error.__traceback__)
    theirs = [frame for frame in frames if Path(frame.filename).resolve() not in _OURS]
    where = f"{Path(theirs[-1].filename).stem}.{theirs[-1].name}" if theirs else method
    text = "".join(traceback.format_list(theirs)) + "".join(traceback.format_exception_only(error))
    return Crash(
        kind="raised",
        error=type(error).__name__,
        message=str(error),
        where=where,
        traceback=text,
    )
