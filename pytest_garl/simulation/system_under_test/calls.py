"""Calls of the landing system's code, and what is recorded where it breaks down."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from pytest_garl.errors import LandingSystemError
from pytest_garl.landing_system import Airframe, airframe_of
from pytest_garl.simulation.flight import Crash
from pytest_garl.simulation.system_under_test.reading import NonsenseError
from pytest_garl.simulation.system_under_test.texts import (
    MESSAGE_CHARS,
    TRACEBACK_CHARS,
    class_name,
    cut_middle,
    identifier_from,
    text_from,
)

_SIMULATION = Path(__file__).parents[1]
_OURS = {_SIMULATION.parent / "landing_system.py", *_SIMULATION.rglob("*.py")}
"""Whose lines are no part of a landing system's traceback."""


class StepGuard(Protocol):
    """Told before and after each call of the landing system's code; the pool's watchdog."""

    def step_begins(self) -> None:
        """User code is about to run."""

    def step_ends(self) -> None:
        """User code has returned or raised."""


class SystemFailedError(Exception):
    """The landing system broke down; carries what the flight records."""

    def __init__(self, crash: Crash) -> None:
        self.crash = crash


class SystemCalls:
    """Calls a landing system under a guard; whatever it raises becomes a SystemFailedError.

    That holds for its SystemExit too.  KeyboardInterrupt passes, it is the user's, and so does what
    a signal of the machine raises in this package.
    """

    def __init__(self, system: Callable[[], Any], guard: StepGuard | None) -> None:
        self._name = _name(system)
        self._guard = guard

    def ask(self, method: str, call: Callable[[], Any]) -> Any:
        """Return what ``call``, of the system's ``method``, returns.

        All that touches what the system made belongs into ``call``: a property or a generator
        runs its code as well.
        """
        if self._guard:
            self._guard.step_begins()
        try:
            return call()
        except KeyboardInterrupt:
            raise
        except NonsenseError as error:
            raise self.nonsense(error.error, str(error), method) from error
        except BaseException as error:
            if _is_asked_to_end(error):
                raise
            # Not ours to name: whatever a landing system raises is how it fails, and a finding.
            raise SystemFailedError(crash_of(error, method)) from error
        finally:
            if self._guard:
                self._guard.step_ends()

    def nonsense(self, error: str, message: str, method: str) -> SystemFailedError:
        """Return what ends the flight where the system made a value that nobody can fly."""
        return SystemFailedError(
            Crash(
                kind="nonsense",
                error=error,
                message=message,
                where=f"{self._name}.{method}",
                traceback="",
            )
        )


def _is_asked_to_end(error: BaseException) -> bool:
    """Whether this package raised a SystemExit itself: a SIGTERM came during the call."""
    if not isinstance(error, SystemExit):
        return False
    last = traceback.extract_tb(error.__traceback__)[-1]
    return Path(last.filename).is_relative_to(_SIMULATION.parent)


def read_airframe(system: object) -> Airframe:
    """Return a system's airframe; raise NonsenseError for what is none."""
    try:
        return airframe_of(system)
    except LandingSystemError as error:
        raise NonsenseError(str(error), "BadAirframe") from None


def crash_of(error: BaseException, method: str) -> Crash:
    """Return the record of what a landing system raised in one of its methods.

    A message is cut after 1,000 characters, a traceback in the middle, to 20,000.
    """
    kind = class_name(type(error))
    try:
        frames = traceback.extract_tb(error.__traceback__)
        theirs = [frame for frame in frames if Path(frame.filename).resolve() not in _OURS]
        lines = traceback.format_list(theirs) + traceback.format_exception_only(error)
        text = cut_middle("".join(lines), TRACEBACK_CHARS)
    except Exception as second:  # noqa: BLE001 (an exception's own code may raise what it likes)
        theirs, text = [], f"{kind}, whose traceback raised {class_name(type(second))}"
    where = (
        f"{identifier_from(Path(theirs[-1].filename).stem)}.{identifier_from(theirs[-1].name)}"
        if theirs
        else ""
    )
    return Crash(
        kind="raised",
        error=kind,
        message=text_from(lambda: str(error), MESSAGE_CHARS, f"<{kind}>, whose str()"),
        where=where or method,
        traceback=text,
    )


def _name(system: Callable[[], Any]) -> str:
    return class_name(system) if isinstance(system, type) else "system"
