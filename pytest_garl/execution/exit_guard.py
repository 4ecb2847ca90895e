"""Keeps a landing system that flies in this process from ending it as if all were well.

A worker may end: its supervisor sees that, and it is a finding.  If this process itself flies, for
a debugger, nobody watches it, and CI reads its exit status.
"""

from __future__ import annotations

import contextlib
import functools
import os
import posix
import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn

from pytest_garl.errors import LandingSystemError

REFUSED_STATUS = 3
"""The status with which a process ends that a thread of a flight before tried to end with 0."""
_NAMES = ("_exit", "execv", "execve")
"""Functions of ``os`` that end a process at once; its others call these."""


class ProcessEnd(SystemExit):
    """What a landing system gets in place of the end of the process.

    A SystemExit of this package passes through the simulator, which takes others for findings.
    """


@dataclass(slots=True, kw_only=True)
class Watch:
    """What a flight in this process tried: ``status`` is None if it did not end the process."""

    status: int | None = None
    stack: str = ""


@dataclass(slots=True, kw_only=True)
class _Guards:
    """The functions that are replaced, the process in which flights are watched, and the flight."""

    originals: dict[str, Callable[..., Any]] = field(default_factory=dict)
    pid: int = 0
    flight: Watch | None = None


_guards = _Guards()


def install() -> None:
    """Replace the functions that end this process, for modules that are imported from here on.

    They do what they did until a flight begins in this process.
    """
    if _guards.originals:
        return
    for name in _NAMES:
        _guards.originals[name] = getattr(posix, name)
        _set(name, _guarded(name, _guards.originals[name]))


def uninstall() -> None:
    """Put the functions back; those that a module holds do what they did."""
    for name, function in _guards.originals.items():
        _set(name, function)
    _guards.originals.clear()
    _guards.pid = 0


@contextlib.contextmanager
def watched_flight() -> Iterator[Watch]:
    """Yield what notes whether the code inside, or a thread of it, tried to end this process."""
    install()
    _guards.pid, _guards.flight = os.getpid(), Watch()
    watch = _guards.flight
    try:
        yield watch
    except ProcessEnd:
        if watch.status is None:
            raise
    finally:
        _guards.flight = None


@contextlib.contextmanager
def refusing_end(system: str) -> Iterator[None]:
    """Raise LandingSystemError if the code inside, of a landing system, tries to end this process.

    Afterwards the functions that end it are those from before.
    """
    with contextlib.ExitStack() as stack:
        if not _guards.originals:
            stack.callback(uninstall)
        watch = stack.enter_context(watched_flight())
        try:
            yield
        except Exception as error:
            if watch.status is None:
                raise
            raise _ended(system, watch) from error
    if watch.status is not None:
        raise _ended(system, watch)


def _ended(system: str, watch: Watch) -> LandingSystemError:
    return LandingSystemError(
        f"{system}: tried to end this process, with status {watch.status}; expected that it "
        f"returns Abort() to give up, or raises an error. It was here:\n{watch.stack.rstrip()}"
    )


def _set(name: str, function: Callable[..., Any]) -> None:
    for module in (os, posix):
        setattr(module, name, function)


def _guarded(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function that refuses a flight what ``function`` does."""

    @functools.wraps(function)
    def guard(*args: Any, **options: Any) -> Any:
        # A child that the landing system forked ends as it likes.
        if _guards.pid != os.getpid():
            return function(*args, **options)
        status = args[0] if name == "_exit" and args else options.get("status", 0)
        if _guards.flight is not None:
            _refuse(_guards.flight, status)
        # A thread of an earlier flight.
        ends_well = name == "_exit" and status == 0
        return function(REFUSED_STATUS) if ends_well else function(*args, **options)

    return guard


def _refuse(watch: Watch, status: int) -> NoReturn:
    if watch.status is None:
        watch.status = status & 0xFF
        watch.stack = "".join(traceback.format_stack(sys._getframe(2)))
    raise ProcessEnd(status)
