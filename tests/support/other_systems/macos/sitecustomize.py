"""Take from every Python that starts what macOS does not have: a test cannot run there.

Put this folder on PYTHONPATH.
"""

import ctypes
import os
import signal

for module, names in (
    (signal, ("SIGRTMAX", "SIGRTMIN")),
    (os, ("sched_getaffinity", "memfd_create", "pidfd_open", "waitid", "pipe2")),
):
    for name in names:
        vars(module).pop(name, None)


def _is_gone(path):
    return isinstance(path, str | os.PathLike) and os.fspath(path).startswith("/proc")


def _without_proc(function):
    def call(path=".", *rest, **named):
        if _is_gone(path):
            raise FileNotFoundError(2, "No such file or directory", os.fspath(path))
        return function(path, *rest, **named)

    return call


for name in ("stat", "lstat", "listdir", "scandir", "open"):
    setattr(os, name, _without_proc(getattr(os, name)))
import io  # noqa: E402 (after the functions that it would keep)

io.open = _without_proc(io.open)


def _symbol(library, name, found=ctypes.CDLL.__getattr__):
    if name in ("prctl", "malloc_trim"):
        raise AttributeError(name)
    return found(library, name)


ctypes.CDLL.__getattr__ = _symbol
