"""The exceptions that pytest-garl raises on purpose, all under one base class."""

from __future__ import annotations

import os
import platform
from typing import Any

from pytest_garl.messages import printable


class GarlError(Exception):
    """Base of every error that pytest-garl raises.

    The message says what was found, where, what was expected and what to do next; it
    is shown to the user as it is, without a traceback.  Control characters in it are written out:
    names and values of files stand in it, and it goes to a terminal.
    """

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


def of_a_user(excinfo: Any) -> bool:
    """Whether an error is one that its message explains, given pytest's ``ExceptionInfo``.

    A module whose ``__tracebackhide__`` this is has no frames in such an error's traceback: pytest
    shows the line of the user's module that made the value.
    """
    return excinfo is not None and isinstance(excinfo.value, GarlError)


class ScenarioError(GarlError):
    """A scenario, map or gene that cannot be flown; the message names file and key."""


class OptionError(GarlError):
    """A command-line option, ini key or marker argument that makes no sense."""


class LandingSystemError(GarlError):
    """A landing system that cannot be loaded or does not keep the contract."""


class PolicyError(GarlError):
    """A policy of moving objects that cannot be loaded, or does what no policy may."""


class LedgerError(GarlError):
    """A ledger that cannot be opened, written or continued."""


class ArchiveError(GarlError):
    """An archive of searches that cannot be read."""


class PoolError(GarlError):
    """Flying processes that cannot be started, or cannot go on."""


class EngineError(GarlError):
    """A physics engine that is unknown, or is not installed."""


class DispatchError(GarlError):
    """A process whose libraries compute with other instructions than all that fly do."""


class CorpusError(GarlError):
    """A folder of cases that cannot be read or written."""


class SavingError(GarlError):
    """A file that cannot be written, or a folder in which nothing can be."""


class BaselineError(GarlError):
    """A baseline cannot be made, written or compared with."""


class ExperimentError(GarlError):
    """An experiment that cannot be flown, or whose rows cannot be read."""


class NotFiniteError(GarlError):
    """A flight with a NaN or an infinity in it: it is written nowhere."""


class SimulatorError(GarlError):
    """A simulator that fails in a fresh process, with a landing system that is known to be good."""


class PlatformError(GarlError):
    """A system on which nothing can be flown."""


def check_platform() -> None:
    """Raise PlatformError on a system that cannot fork, as a worker does for each flight."""
    if not hasattr(os, "fork"):
        raise PlatformError(
            f"{platform.system()} cannot fly: pytest-garl needs Linux or macOS; on Windows install "
            "it in WSL, the Windows Subsystem for Linux"
        )
