"""Take from every Python that starts what macOS does not have: a test cannot run there.

Put this folder on PYTHONPATH.
"""

import ctypes
import io
import os
import signal
from collections.abc import Callable
from typing import Any

for module, names in (
    (signal, ("SIGRTMAX", "SIGRTMIN")),
    (os, ("sched_getaffinity", "memfd_create", "pidfd_open", "waitid", "pipe2")),
):
    for name in names:
        vars(module).pop(name, None)


def _without_proc(function: Callable[..., Any]) -> Callable[..., Any]:
    def call(path: Any = ".", *rest: Any, **named: Any) -> Any:
        if isinstance(path, str | os.PathLike) and os.fspath(path).startswith("/proc"):
            raise FileNotFoundError(2, "No such file or directory", os.fspath(path))
        return function(path, *rest, **named)

    return call


def _without_symbols(found: Callable[..., Any]) -> Callable[..., Any]:
    def symbol(library: ctypes.CDLL, name: str) -> Any:
        if name in ("prctl", "malloc_trim"):
            raise AttributeError(name)
        return found(library, name)

    return symbol


for name in ("stat", "lstat", "listdir", "scandir", "open"):
    vars(os)[name] = _without_proc(vars(os)[name])
vars(io)["open"] = _without_proc(io.open)
type.__setattr__(ctypes.CDLL, "__getattr__", _without_symbols(ctypes.CDLL.__getattr__))
