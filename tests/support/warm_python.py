"""Runs of pytest and of ``garl`` in processes of their own that need not import everything first.

``python -m pytest`` with this plugin imports for half a second, several hundred times in these
tests.  A server imports once and forks a run for each command.  Such a run is a process of its own:
its folder, environment, arguments and files are its own, and nothing of it reaches another run or a
test.  It differs from a fresh interpreter in what was imported before and in the seed of hashes,
which all runs of a server share.  A command whose environment differs in what an interpreter reads
at its start, such as PYTHONHASHSEED, starts a fresh one.
"""

from __future__ import annotations

import atexit
import functools
import json
import os
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pytest_garl import cpu_dispatch
from tests.support.warm_server import LONGEST_REQUEST

READ_AT_START = ("PYTHON", "LC_", "LANG")
"""How variables begin that an interpreter reads when it starts."""
GARL = "from pytest_garl.cli import main"


class WarmPopen(subprocess.Popen[Any]):
    """``subprocess.Popen``, which has the server fork Python if that is to run pytest or garl."""

    _is_warm = False

    def _execute_child(self, *given: Any) -> None:
        """Start the command; the names are those of ``subprocess`` in Python 3.11."""
        args, executable, preexec_fn, _, pass_fds, cwd, env = given[:7]
        p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite = given[10:16]
        start_new_session = given[21]
        environment = dict(os.environ if env is None else env)
        plain = not (executable or preexec_fn or pass_fds or start_new_session)
        if not (plain and _imports_much(args) and _is_as_here(environment)):
            start: Any = super()
            start._execute_child(*given)
            return
        request = {
            "command": [os.fspath(each) for each in args],
            "folder": str(Path(cwd or ".").absolute()),
            "environment": environment,
        }
        files = [
            standard if file == -1 else file
            for standard, file in enumerate((p2cread, c2pwrite, errwrite))
        ]
        self._is_warm = True
        self.pid = _server().start(request, files)
        self._child_created = True
        close: Any = self
        close._close_pipe_fds(p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite)

    def _try_wait(self, wait_flags: int) -> tuple[int, int]:
        if self._is_warm:
            return _server().status_of(self.pid, wait_flags)
        wait: Any = super()
        found: tuple[int, int] = wait._try_wait(wait_flags)
        return found

    def _internal_poll(self, *given: Any, **named: Any) -> int | None:
        if self._is_warm:
            named["_waitpid"] = _server().status_of
        poll: Any = super()
        status: int | None = poll._internal_poll(*given, **named)
        return status


class _Server:
    """The process that forks runs, and the connection to it."""

    def __init__(self) -> None:
        self.environment = dict(os.environ)
        self._connection, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        script = Path(__file__).with_name("warm_server.py")
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-P", str(script), str(other.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[other.fileno()],
                env={**self.environment, "PYTHONPATH": ""},
            )
        self._statuses: dict[int, int] = {}

    def start(self, request: Mapping[str, Any], files: Sequence[int]) -> int:
        """Fork a run with these files as 0, 1 and 2; return its process id."""
        socket.send_fds(self._connection, [json.dumps(request).encode()], files)
        while "started" not in (answer := self._next_answer()):
            pass
        return answer["started"]

    def status_of(self, pid: int, flags: int) -> tuple[int, int]:
        """Return what ``os.waitpid`` would if the run were a child of this process."""
        while pid not in self._statuses:
            try:
                self._next_answer(socket.MSG_DONTWAIT if flags & os.WNOHANG else 0)
            except BlockingIOError:
                return 0, 0
        return pid, self._statuses[pid]

    def _next_answer(self, flags: int = 0) -> dict[str, int]:
        text = self._connection.recv(LONGEST_REQUEST, flags)
        assert text, f"the server of warm runs has ended: {self._process.wait()}"
        answer: dict[str, int] = json.loads(text)
        if "ended" in answer:
            self._statuses[answer["ended"]] = answer["status"]
        return answer

    def close(self) -> None:
        """End the server and its runs."""
        self._connection.close()
        self._process.wait()


@functools.cache
def _server() -> _Server:
    server = _Server()
    atexit.register(server.close)
    return server


def _imports_much(command: Any) -> bool:
    """Whether a command is Python that runs pytest or garl."""
    if isinstance(command, str | bytes | os.PathLike) or command[0] != sys.executable:
        return False
    words = [os.fspath(each) for each in command[1:3]]
    if words[0] == "-c":
        return GARL in words[1]
    return words[0] == "-mpytest" or words == ["-m", "pytest"]


def _is_as_here(environment: Mapping[str, str]) -> bool:
    """Whether a process would find in this environment what the server found at its start."""
    return _read_at_start(environment) == _read_at_start(_server().environment)


def _read_at_start(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that a process must have before it starts or imports NumPy."""
    names = {name for name in environment if name.startswith(READ_AT_START)}
    names = (names | set(cpu_dispatch.environment())) - {"PYTHONPATH"}
    return {name: environment[name] for name in names if name in environment}
