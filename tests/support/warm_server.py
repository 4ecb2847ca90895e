"""A process that has imported what runs of pytest and garl import, and forks a run on request.

Started by ``tests.support.warm_python``, which says why.  A run gets its own folder, environment,
arguments and files; modules of the project that it tests were never imported here.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import runpy
import select
import signal
import socket
import sys
import tempfile
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

from _pytest.config import _prepareconfig

IMPORTED_LATE = (
    "faulthandler",
    "pdb",
    "pybullet",
    "pytest_garl.cli",
    "pytest_garl.execution.on_demand",
    "pytest_garl.reports.causes",
    "pytest_garl.search.methods.garl",
    "pytest_garl.search.methods.random",
    "pytest_garl.simulation.environment",
    "scipy.special",
)
"""What a run imports after its start, beside the plugin's modules."""
LONGEST_REQUEST = 2**20


def import_all() -> None:
    """Import pytest, its plugins and pytest-garl as a run does: with rewritten assertions."""
    with tempfile.TemporaryDirectory() as folder:
        config = _prepareconfig(["-s", "-c", os.devnull, "--rootdir", folder, folder])
        plugin = importlib.import_module("pytest_garl.plugin")
        late = [f"{plugin.__name__}.{each.name}" for each in iter_modules(plugin.__path__)]
        for name in [*late, *IMPORTED_LATE]:
            importlib.import_module(name)
        config._ensure_unconfigure()
    gc.collect()
    # A run need not look at what was made here whenever it collects.
    gc.freeze()


def serve(connection: socket.socket) -> dict[str, Any] | None:
    """Fork a run for each request; return the request in the run, and None at the end here."""
    woken, waker = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    signal.set_wakeup_fd(waker)
    running: set[int] = set()
    while True:
        ready, _, _ = select.select([connection.fileno(), woken], [], [])
        if woken in ready:
            os.read(woken, LONGEST_REQUEST)
            _reap(connection, running)
        if connection.fileno() not in ready:
            continue
        text, files, _, _ = socket.recv_fds(connection, LONGEST_REQUEST, 3)
        if not text:
            for pid in running:
                os.kill(pid, signal.SIGKILL)
            return None
        pid = os.fork()
        if pid == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            connection.close()
            os.close(woken)
            os.close(waker)
            for number, file in enumerate(files):
                os.dup2(file, number)
                os.close(file)
            request: dict[str, Any] = json.loads(text)
            return request
        running.add(pid)
        for file in files:
            os.close(file)
        connection.send(json.dumps({"started": pid}).encode())


def _reap(connection: socket.socket, running: set[int]) -> None:
    """Tell how each run ended that has ended."""
    while running:
        pid, status = os.waitpid(-1, os.WNOHANG)
        if not pid:
            break
        running.discard(pid)
        connection.send(json.dumps({"ended": pid, "status": status}).encode())


def run(request: dict[str, Any], path: list[str]) -> None:
    """Run what Python with these arguments runs."""
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.orig_argv[:] = request["command"]
    _, option, *words = request["command"]
    if option == "-m":
        option += words.pop(0)
    name = option.removeprefix("-m")
    first = "" if name == "-c" else request["folder"]
    searched = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    sys.path[:] = [first, *filter(None, searched), *path]
    importlib.invalidate_caches()
    tempfile.tempdir = None
    if name == "-c":
        code = words.pop(0)
        sys.argv[:] = ["-c", *words]
        module = sys.modules["__main__"] = ModuleType("__main__")
        exec(compile(code, "<string>", "exec"), module.__dict__)
    else:
        sys.argv[:] = ["-m", *words]
        runpy.run_module(name, run_name="__main__", alter_sys=True)


def main() -> None:
    """Serve on the connection that the first argument names."""
    import_all()
    path = list(sys.path)
    request = serve(socket.socket(fileno=int(sys.argv[1])))
    if request is not None:
        run(request, path)


if __name__ == "__main__":
    main()
