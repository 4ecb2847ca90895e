"""Calls of the landing system's code, and the record of its errors."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from pytest_garl.errors import LandingSystemError
from pytest_garl.flight.flight import Crash
from pytest_garl.foreign_text import (
    MESSAGE_CHARS,
    TRACEBACK_CHARS,
    class_name,
    cut,
    cut_middle,
    identifier_from,
    text_from,
)
from pytest_garl.landing_system import Airframe, airframe_of
from pytest_garl.program import ProgramFailedError, ProgramSystem
from pytest_garl.simulation.system_under_test.reading import NonsenseError

_SIMULATION = Path(__file__).parents[1]
_OWN_FILES = {
    _SIMULATION.parent / "airframe.py",
    _SIMULATION.parent / "landing_system.py",
    *(
        file
        for room in ("simulation", "external", "companion", "execution")
        for file in (_SIMULATION.parent / room).rglob("*.py")
    ),
}
"""Files whose frames are left out of the traceback of a landing system."""


class StepGuard(Protocol):
    """Watches calls of the landing system's code, so that a pool can end a call that hangs."""

    def step_begins(self) -> None:
        """Note that user code is about to run."""

    def step_ends(self) -> None:
        """Note that user code has returned or raised."""


class SystemFailedError(Exception):
    """The landing system failed; ``crash`` is what the flight records."""

    def __init__(self, crash: Crash) -> None:
        self.crash = crash


class SystemCalls:
    """Calls a landing system under a guard; every error of it becomes a SystemFailedError.

    Its SystemExit does too.  A KeyboardInterrupt of the user passes, and so does a SystemExit that
    this package raises on a signal.
    """

    def __init__(self, system: Callable[[], Any], guard: StepGuard | None) -> None:
        self._name = _system_name(system)
        self._guard = guard

    def run(self, method: str, code: Callable[[], Any]) -> Any:
        """Return the result of ``code``, which calls the system's ``method``.

        Every use of a value that the system returned belongs into ``code`` too, because a property
        or a generator runs the system's code.
        """
        if self._guard:
            self._guard.step_begins()
        try:
            return code()
        except KeyboardInterrupt:
            raise
        except NonsenseError as error:
            raise self.nonsense_error(error.error, str(error), method) from error
        except BaseException as error:
            if _is_own_system_exit(error):
                raise
            # A landing system may raise anything; every exception is a finding.
            raise SystemFailedError(crash_of(error, method)) from error
        finally:
            if self._guard:
                self._guard.step_ends()

    def nonsense_error(self, error: str, message: str, method: str) -> SystemFailedError:
        """Return the error for a value of the system that cannot be flown."""
        return SystemFailedError(
            Crash(
                kind="nonsense",
                error=error,
                message=message,
                where=f"{self._name}.{method}",
                traceback="",
            )
        )


def _is_own_system_exit(error: BaseException) -> bool:
    """Whether this package raised a SystemExit itself: a SIGTERM came during the call."""
    if not isinstance(error, SystemExit):
        return False
    last = traceback.extract_tb(error.__traceback__)[-1]
    return Path(last.filename).is_relative_to(_SIMULATION.parent)


def read_airframe(system: object) -> Airframe:
    """Return a system's airframe; raise NonsenseError if it is not valid."""
    try:
        return airframe_of(system)
    except LandingSystemError as error:
        raise NonsenseError(str(error), "BadAirframe") from None


def crash_of(error: BaseException, method: str) -> Crash:
    """Return the record of an exception from one of a landing system's methods, or of a program.

    A message is cut after 1,000 characters, a traceback in the middle, to 20,000.
    """
    if isinstance(error, ProgramFailedError):
        return Crash(
            kind=error.kind,
            error=identifier_from(error.error),
            message=cut(error.message, MESSAGE_CHARS),
            where=identifier_from(error.where),
            traceback=cut_middle(error.trace, TRACEBACK_CHARS),
        )
    kind = class_name(type(error))
    try:
        frames = traceback.extract_tb(error.__traceback__)
        system_frames = [
            frame for frame in frames if Path(frame.filename).resolve() not in _OWN_FILES
        ]
        lines = traceback.format_list(system_frames) + traceback.format_exception_only(error)
        text = cut_middle("".join(lines), TRACEBACK_CHARS)
    except Exception as second:  # noqa: BLE001 (code of an exception may raise anything)
        system_frames, text = [], f"{kind}, whose traceback raised {class_name(type(second))}"
    where = (
        f"{identifier_from(Path(system_frames[-1].filename).stem)}.{identifier_from(system_frames[-1].name)}"
        if system_frames
        else ""
    )
    return Crash(
        kind="raised",
        error=kind,
        message=text_from(lambda: str(error), MESSAGE_CHARS, f"<{kind}>, whose str()"),
        where=where or method,
        traceback=text,
    )


def _system_name(system: Callable[[], Any]) -> str:
    if isinstance(system, ProgramSystem):
        return system.name
    return class_name(system) if isinstance(system, type) else "system"
