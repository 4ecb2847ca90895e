"""Detects changes that a landing system made to its process and that alter later flights."""

from __future__ import annotations

import builtins
import contextlib
import ctypes
import importlib
import locale
import os
import platform
import resource
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from pytest_garl.engine import chosen
from pytest_garl.npcs.policy_catalogue import scripted_policies

OURS = "pytest_garl"
FLYING = (
    "npcs.learned",
    "npcs.recorded",
    *(f"npcs.policies.{name}" for name in scripted_policies()),
    "execution.fly_and_judge",
    "execution.severity_of_flight",
    "scenarios.files",
    "flight.flight_file",
    "simulation.fly",
    "simulation.system_under_test.reference_pilot",
    "verdicts.judge",
)
"""Modules that a flight imports beside the world of its engine; they import the rest."""
SHARED = {
    *("cv2", "json", "math", "mujoco", "numpy", "os", "pathlib", "pybullet"),
    *("random", "struct", "time"),
}
"""Foreign packages with which the simulator computes."""
MAX_LEFT_THREADS = 8
MAX_LEFT_FILES = 64
MAX_MEMORY_GROWTH_BYTES = 2**30
"""If flights leave more threads, open files or bytes of memory, their process is replaced."""
_LIMITED = (
    resource.RLIMIT_NOFILE,
    resource.RLIMIT_FSIZE,
    resource.RLIMIT_AS,
    resource.RLIMIT_DATA,
)
_ENVIRONMENT_BYTES = 64
"""More than ``fenv_t`` has of any C library."""
_X87, _MXCSR = slice(0, 2), slice(28, 32)
"""Where ``fenv_t`` of x86-64 holds the control words of the x87 and of SSE, which all code that
was compiled for speed uses."""
_MXCSR_FLAGS = 0x3F
"""Bits that say what has occurred, such as an inexact result; they set nothing."""
_GONE = object()


class ProcessState:
    """The process before its first flight: all functions and settings that flights share.

    A new attribute of a module is no change, since NumPy sets some at first use.  A function that
    was replaced is a change.
    """

    def __init__(self) -> None:
        for name in (*FLYING, f"simulation.physics.{chosen()}_world"):
            importlib.import_module(f"{OURS}.{name}")
        self._namespaces = [(space, dict(values)) for space, values in _namespaces()]
        self._settings = _settings()
        self._files, self._bytes = _open_files(), 0

    def limited(self) -> bool:
        """Whether a landing system has changed or used up this process's resource limits."""
        return self._settings["limits"] != _limits() or not _can_open()

    def changed(self) -> bool:
        """Whether the next flight needs a fresh process."""
        try:
            return self._differs()
        except Exception:  # noqa: BLE001 (a function called here may be one that was replaced)
            return True

    def _differs(self) -> bool:
        peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        self._bytes = self._bytes or peak
        return (
            _has_live_children()
            or self._settings != _settings()
            or threading.active_count() > MAX_LEFT_THREADS
            or _open_files() > self._files + MAX_LEFT_FILES
            or peak > self._bytes + MAX_MEMORY_GROWTH_BYTES
            or any(
                space.get(name, _GONE) is not value
                for space, values in self._namespaces
                for name, value in values.items()
            )
        )


def _namespaces() -> Iterator[tuple[Any, dict[str, Any]]]:
    """Yield namespaces, each with the names that must keep their values."""
    modules = {name: module for name, module in sys.modules.items() if _is_checked(name)}
    yield sys.modules, dict(modules)
    yield vars(builtins), _functions(builtins)
    for name, module in modules.items():
        if not name.startswith(OURS):
            yield vars(module), _functions(module)
            continue
        yield vars(module), vars(module)
        for value in list(vars(module).values()):
            if isinstance(value, type) and value.__module__ == name:
                yield vars(value), dict(vars(value))


def _is_checked(name: str) -> bool:
    return name.partition(".")[0] in SHARED | {OURS} and isinstance(sys.modules[name], ModuleType)


def _functions(module: ModuleType) -> dict[str, Any]:
    return {name: value for name, value in vars(module).items() if callable(value)}


def _settings() -> dict[str, Any]:
    """Return the settings that all flights of a process share."""
    import cv2
    import numpy as np

    return {
        "folder": _folder(),
        "limits": _limits(),
        "standard files": [_identity(number) for number in range(3)],
        "NumPy": (np.geterr(), np.geterrcall()),
        "OpenCV": (cv2.getNumThreads(), cv2.useOptimized()),
        # Imports add filters that hide warnings; these change no flight.
        "warnings": [each for each in warnings.filters if each[0] == "error"],
        "locale": locale.setlocale(locale.LC_ALL),
        "tracing": (sys.gettrace(), sys.getprofile()),
        "recursion": sys.getrecursionlimit(),
        "alarm": signal.getitimer(signal.ITIMER_REAL) != (0.0, 0.0),
        # Libraries that were compiled for speed switch these off when they are loaded.
        "subnormal numbers": float(np.float64(sys.float_info.min) * 0.5) > 0,
        "rounding": _rounding(),
    }


def _rounding() -> tuple[int, ...]:
    """Return how this thread rounds and which floating-point errors it raises.

    ``fegetround`` alone would not do: on x86-64 it reads the x87, with which nobody computes.
    """
    library = ctypes.CDLL(None)
    if platform.machine() != "x86_64":
        return (int(library.fegetround()),)
    environment = ctypes.create_string_buffer(_ENVIRONMENT_BYTES)
    library.fegetenv(environment)
    x87, mxcsr = (int.from_bytes(environment.raw[part], "little") for part in (_X87, _MXCSR))
    return x87, mxcsr & ~_MXCSR_FLAGS


def _folder() -> str:
    try:
        return str(Path.cwd())
    except OSError:
        return ""


def _limits() -> list[tuple[int, int]]:
    """Return the resource limits of this process."""
    return [resource.getrlimit(name) for name in _LIMITED]


def _identity(number: int) -> tuple[int, int]:
    """Return the device and inode of a descriptor's file."""
    try:
        status = os.fstat(number)
    except OSError:
        return -1, -1
    return status.st_dev, status.st_ino


def _open_files() -> int:
    for folder in ("/proc/self/fd", "/dev/fd"):
        with contextlib.suppress(OSError):
            return len(list(Path(folder).iterdir()))
    return sys.maxsize


def _can_open() -> bool:
    try:
        os.close(os.open(os.devnull, os.O_RDONLY))
    except OSError:
        return False
    return True


def _has_live_children() -> bool:
    """Whether a process that flights have started still lives; reap those that have ended."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return False
    return True
