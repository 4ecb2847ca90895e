"""End a session on SIGTERM as Ctrl-C ends it: with its summary and the line that continues.

A build server sends SIGTERM when the time of a job is up or somebody cancels it, and SIGKILL a few
seconds later.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from pytest_garl.plugin.xdist import is_xdist_worker

if TYPE_CHECKING:
    from pytest_garl.execution.ledger import Ledger

_LOOK_S = 0.5


class Terminated(KeyboardInterrupt):
    """SIGTERM came; pytest treats it as Ctrl-C."""


def interrupt_on_sigterm(config: pytest.Config) -> None:
    """Have SIGTERM interrupt this session until pytest is unconfigured.

    A handler of the user stays.  The workers of pytest-xdist end with their controller.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or is_xdist_worker(config):
        return
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _interrupt)
        config.add_cleanup(_restore)


def is_interrupted_by_user(kind: type[BaseException]) -> bool:
    """Return whether an exception of this type is Ctrl-C or SIGTERM.

    pytest and xdist stop after ``-x`` by exceptions that inherit from KeyboardInterrupt.
    """
    return kind in (KeyboardInterrupt, Terminated)


def ignore_further_sigterm() -> None:
    """Let an interrupted session write its summary.

    GitHub sends SIGINT, and SIGTERM 7.5 s later; `timeout` sends SIGTERM to the process and then to
    its group.  Ctrl-C still ends the session.
    """
    if signal.getsignal(signal.SIGTERM) is _interrupt:
        # Not SIG_IGN, which the processes that are started later would inherit.
        signal.signal(signal.SIGTERM, _ignore)


@contextmanager
def telling_workers(ledger: Ledger) -> Iterator[None]:
    """Tell xdist's workers if the block is interrupted.

    A terminal sends Ctrl-C to all processes, but execnet ignores it in its workers, and interrupts
    them 5 s after their controller has ended.  A build server has killed both by then.
    """
    try:
        yield
    except KeyboardInterrupt:
        ledger.facts.note_interrupted()
        raise


class ControllerWatch:
    """Ends the wait of an xdist worker for a flight if its controller is interrupted."""

    def __init__(self) -> None:
        self._looked = time.monotonic()

    def look(self, ledger: Ledger) -> None:
        """Raise KeyboardInterrupt if the controller was interrupted."""
        if time.monotonic() - self._looked < _LOOK_S:
            return
        self._looked = time.monotonic()
        if ledger.facts.interrupted:
            raise KeyboardInterrupt


def _interrupt(number: int, frame: object) -> None:
    ignore_further_sigterm()
    raise Terminated("SIGTERM")


def _ignore(number: int, frame: object) -> None:
    """Do nothing."""


def _restore() -> None:
    if signal.getsignal(signal.SIGTERM) in (_interrupt, _ignore):
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
