"""Runs of pytest and of ``garl`` in processes of their own that need not import everything first.

``python -m pytest`` with this plugin imports for half a second, several hundred times in these
tests.  A server, which is this file as a script, imports once and forks a run for each command.
Such a run is a process of its own: its folder, environment, arguments and files are its own, and
nothing of it reaches another run or a test.  The server forks the workers of a run's xdist, too.
A run forks a spare process before it does anything else; if it has flights judged, the spare does.

A run differs from a fresh interpreter in what was imported before, in its parent, and in the seed
of hashes, which all runs of a server share.  A command whose environment differs in what an
interpreter reads at its start gets a fresh one: ``COLD`` is such a difference.
"""

from __future__ import annotations

import atexit
import fcntl
import gc
import importlib
import inspect
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from pkgutil import walk_packages
from types import ModuleType
from typing import Any, ClassVar, Self

IMPORTED_LATE = (
    "faulthandler",
    "pdb",
    "pybullet",
    "pytest_garl.cli",
    "pytest_garl.execution.on_demand",
    "pytest_garl.reports.causes",
    "pytest_garl.search.evolution",
    "pytest_garl.search.methods.garl",
    "pytest_garl.search.methods.random",
    "pytest_garl.simulation.environment",
    "scipy.special",
    "xdist.remote",
)
"""What a run imports after its start, beside the plugin's modules."""
READ_AT_START = ("PYTHON", "LC_", "LANG")
"""How variables begin that an interpreter reads when it starts."""
COLD = {"PYTHONHASHSEED": "random"}
"""What the environment of a command has that must not be forked."""
GARL = "from pytest_garl.cli import main"
JUDGE = ["-m", "pytest_garl.execution.judge_process"]
XDIST = ["-u", "-c", "import sys;exec(eval(sys.stdin.readline()))"]
LONGEST_MESSAGE = 2**20


class WarmPopen(subprocess.Popen[Any]):
    """``subprocess.Popen``, which has the server fork Python if that is to run pytest or garl."""

    server: ClassVar[Server | None] = None
    spare: ClassVar[Spare | None] = None
    environment: ClassVar[Mapping[str, str]] = dict(os.environ)
    """The server's, which starts in a test that may have changed its own."""
    _is_warm = False

    def _execute_child(self, *given: Any) -> None:
        """Start the command; the names are those of ``subprocess`` in Python 3.11 to 3.13."""
        args, executable, preexec_fn, _, pass_fds, cwd, env = given[:7]
        files, start_new_session = given[10:16], given[21]
        environment = dict(os.environ if env is None else env)
        standard = [
            number if file == -1 else file
            for number, file in enumerate((files[0], files[3], files[5]))
        ]

        def request() -> dict[str, Any]:
            return {
                "command": [os.fspath(each) for each in args],
                "folder": str(Path(cwd or ".").absolute()),
                "environment": environment,
            }

        plain = not (executable or preexec_fn or pass_fds or start_new_session)
        if plain and _imports_much(args) and self._server().is_found_in(environment):
            self._is_warm = True
            self.pid = self._server().start(request(), standard)
        elif self.spare and _judges(args) and self.spare.is_found_in(environment):
            self.pid = self.spare.start(request(), standard, pass_fds)
        else:
            start: Any = super()
            start._execute_child(*given)
            return
        self._child_created = True
        close: Any = self
        close._close_pipe_fds(*files)

    def _try_wait(self, wait_flags: int) -> tuple[int, int]:
        if self._is_warm:
            return self._server().status_of(self.pid, wait_flags)
        wait: Any = super()
        found: tuple[int, int] = wait._try_wait(wait_flags)
        return found

    def _internal_poll(self, *given: Any, **named: Any) -> int | None:
        ours: Any = self
        if not self._is_warm:
            poll: Any = super()
            status: int | None = poll._internal_poll(*given, **named)
            return status
        if self.returncode is None and ours._waitpid_lock.acquire(blocking=False):
            try:
                pid, ended = self._server().status_of(self.pid, os.WNOHANG)
                if pid and self.returncode is None:
                    ours._handle_exitstatus(ended)
            finally:
                ours._waitpid_lock.release()
        return self.returncode

    @classmethod
    def _server(cls) -> Server:
        if cls.server is None:
            cls.server = Server.of_this_process(cls.environment)
        return cls.server


def _words(command: Any) -> list[str]:
    """Return the first arguments of a command that is Python."""
    if isinstance(command, str | bytes | os.PathLike) or command[0] != sys.executable:
        return []
    return [os.fspath(each) for each in command[1:4]]


def _judges(command: Any) -> bool:
    """Whether a command is Python that judges flights for a run."""
    return _words(command)[:2] == JUDGE


def _imports_much(command: Any) -> bool:
    """Whether a command is Python that runs pytest, garl or a worker of xdist."""
    words = _words(command)
    if not words:
        return False
    if words[0] == "-c":
        return GARL in words[1]
    return words[0] == "-mpytest" or words[:2] == ["-m", "pytest"] or words == XDIST


class Server:
    """A connection to the process that forks runs."""

    def __init__(self, connection: socket.socket, environment: Mapping[str, str]) -> None:
        self._connection = connection
        self._read_at_start = _read_at_start(environment)
        self._statuses: dict[int, int] = {}
        self._started: list[int] = []
        self._starting = threading.Lock()
        self._news = threading.Condition()
        """Guards what was read, and whether a thread reads."""
        self._is_read = False

    @classmethod
    def of_this_process(cls, environment: Mapping[str, str]) -> Self:
        """Start a server that has this environment and ends with this process."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            process = subprocess.Popen(
                [sys.executable, "-P", __file__, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                env={**environment, "PYTHONPATH": ""},
            )
        # It leaves the server behind as nobody's child: tests count the children of this process.
        process.wait()
        atexit.register(ours.close)
        return cls(ours, environment)

    def is_found_in(self, environment: Mapping[str, str]) -> bool:
        """Whether an interpreter would read from this environment what the server has read."""
        return _read_at_start(environment) == self._read_at_start

    def start(self, request: Mapping[str, Any], files: Sequence[int]) -> int:
        """Fork a run with these files as 0, 1 and 2; return its process id."""
        with self._starting:
            socket.send_fds(self._connection, [json.dumps(request).encode()], files)
            self._read_until(lambda: bool(self._started))
            return self._started.pop()

    def status_of(self, pid: int, flags: int) -> tuple[int, int]:
        """Return what ``os.waitpid`` would if the run were a child of this process."""
        if not self._read_until(lambda: pid in self._statuses, waits=not flags & os.WNOHANG):
            return 0, 0
        return pid, self._statuses[pid]

    def _read_until(self, has_come: Callable[[], bool], *, waits: bool = True) -> bool:
        """Read answers until one has come; one thread reads for all, for it may read another's."""
        with self._news:
            while not has_come():
                if self._is_read and not waits:
                    return False
                if self._is_read:
                    self._news.wait()
                    continue
                self._is_read = True
                self._news.release()
                try:
                    text = self._connection.recv(
                        LONGEST_MESSAGE, 0 if waits else socket.MSG_DONTWAIT
                    )
                except BlockingIOError:
                    return False
                finally:
                    self._news.acquire()
                    self._is_read = False
                    self._news.notify_all()
                self._keep(text)
        return True

    def _keep(self, text: bytes) -> None:
        assert text, "the server of warm runs has ended"
        answer: dict[str, int] = json.loads(text)
        if "started" in answer:
            self._started.append(answer["started"])
        else:
            self._statuses[answer["ended"]] = answer["status"]


class Spare:
    """A process that a run has forked before it does anything, for the first judge it starts.

    The run is its parent, as of any process that it starts.
    """

    def __init__(self) -> None:
        self._connection, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._read_at_start = _read_at_start(os.environ)
        self._is_started = False
        self.request: dict[str, Any] | None = None
        """In the spare process: what it runs."""
        self.pid = os.fork()
        if self.pid == 0:
            self._connection.close()
            self._wait(theirs)
        theirs.close()

    def is_found_in(self, environment: Mapping[str, str]) -> bool:
        """Whether it is left, and an interpreter would read from the environment what it has."""
        return not self._is_started and _read_at_start(environment) == self._read_at_start

    def start(self, request: Mapping[str, Any], files: Sequence[int], passed: Sequence[int]) -> int:
        """Have it run a command with these files, in a session of its own; return its id."""
        self._is_started = True
        text = json.dumps({**request, "files": [0, 1, 2, *passed]}).encode()
        socket.send_fds(self._connection, [text], [*files, *passed])
        self._connection.close()
        return self.pid

    def _wait(self, connection: socket.socket) -> None:
        """Wait for the request, deaf and mute; end if the run has ended without one."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        nothing = os.open(os.devnull, os.O_RDWR)
        for number in (0, 1, 2):
            os.dup2(nothing, number)
        os.close(nothing)
        text, files, _, _ = socket.recv_fds(connection, LONGEST_MESSAGE, 8)
        connection.close()
        if not text:
            os._exit(0)
        os.setsid()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        self.request = request = json.loads(text)
        # First out of the way: the number of one may be that which another gets.
        above = 1 + max(request["files"])
        moved = [fcntl.fcntl(file, fcntl.F_DUPFD, above) for file in files]
        for file in files:
            os.close(file)
        for file, number in zip(moved, request["files"], strict=True):
            os.dup2(file, number)
            os.close(file)


def _read_at_start(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that a process must have before it starts or imports NumPy."""
    from pytest_garl import cpu_dispatch

    names = {name for name in environment if name.startswith(READ_AT_START)}
    names = (names | set(cpu_dispatch.environment())) - {"PYTHONPATH"}
    return {name: environment[name] for name in names if name in environment}


def import_all() -> None:
    """Import pytest, its plugins and pytest-garl as a run does: with rewritten assertions."""
    from _pytest.config import _prepareconfig

    with tempfile.TemporaryDirectory() as folder:
        config = _prepareconfig(["-s", "-c", os.devnull, "--rootdir", folder, folder])
        plugin = importlib.import_module("pytest_garl.plugin")
        late = [each.name for each in walk_packages(plugin.__path__, f"{plugin.__name__}.")]
        for name in [*late, *IMPORTED_LATE]:
            importlib.import_module(name)
        config._ensure_unconfigure()
    # A run asks for these hashes of the package, which take longer than its flights.
    importlib.import_module("pytest_garl.execution.sources").flight_code_sha256()
    importlib.import_module("pytest_garl.execution.reference").package_sha256()
    # The first failure of a run asks for the file of each module that is loaded.
    inspect.getmodule(import_all.__code__)
    gc.collect()
    # A run need not look at what was made here whenever it collects.
    gc.freeze()


class Forks:
    """What the server does: it forks a run for each request, and tells how each ends."""

    def __init__(self, connection: socket.socket) -> None:
        self._first = connection
        self._connections = [connection]
        """To the process that started it, and to each run of xdist."""
        self._runs: dict[int, socket.socket] = {}
        self._woken, self._waker = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        signal.signal(signal.SIGCHLD, lambda number, frame: None)
        signal.set_wakeup_fd(self._waker)

    def serve(self) -> tuple[dict[str, Any], socket.socket] | None:
        """Return a request and a connection to the server in its run, and None at the end here."""
        while True:
            files = [self._woken, *(each.fileno() for each in self._connections)]
            ready, _, _ = select.select(files, [], [])
            if self._woken in ready:
                os.read(self._woken, LONGEST_MESSAGE)
                self._reap()
            for connection in list(self._connections):
                if connection.fileno() not in ready:
                    continue
                text, files, _, _ = socket.recv_fds(connection, LONGEST_MESSAGE, 3)
                if text and (theirs := self._fork(connection, files)):
                    return json.loads(text), theirs
                if not text:
                    self._end(connection)
                if self._first not in self._connections:
                    return None

    def _fork(self, connection: socket.socket, files: Sequence[int]) -> socket.socket | None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        pid = os.fork()
        if pid == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for each in (ours, *self._connections):
                each.close()
            os.close(self._woken)
            os.close(self._waker)
            for number, file in enumerate(files):
                os.dup2(file, number)
                os.close(file)
            return theirs
        theirs.close()
        for file in files:
            os.close(file)
        self._connections.append(ours)
        self._runs[pid] = connection
        connection.send(json.dumps({"started": pid}).encode())
        return None

    def _end(self, connection: socket.socket) -> None:
        """End the runs that were started by a process which has ended."""
        self._connections.remove(connection)
        connection.close()
        for pid, starter in self._runs.items():
            if starter is connection:
                os.kill(pid, signal.SIGKILL)

    def _reap(self) -> None:
        while self._runs:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if not pid:
                break
            starter = self._runs.pop(pid)
            if starter in self._connections:
                starter.send(json.dumps({"ended": pid, "status": status}).encode())


def run(request: dict[str, Any], path: list[str]) -> None:
    """Run what Python with these arguments runs."""
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    tempfile.tempdir = None
    sys.orig_argv[:] = request["command"]
    words = [word for word in request["command"][1:] if word != "-u"]
    option = words.pop(0)
    if option == "-m":
        option += words.pop(0)
    name = option.removeprefix("-m")
    first = "" if name == "-c" else request["folder"]
    searched = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    sys.path[:] = [first, *filter(None, searched), *path]
    importlib.invalidate_caches()
    if name == "-c":
        code = words.pop(0)
        sys.argv[:] = ["-c", *words]
        module = sys.modules["__main__"] = ModuleType("__main__")
        exec(compile(code, "<string>", "exec"), module.__dict__)
    else:
        sys.argv[:] = ["-m", *words]
        runpy.run_module(name, run_name="__main__", alter_sys=True)


def main() -> None:
    """Serve on the connection that the first argument names, until its other end is closed."""
    if os.fork():
        os._exit(0)
    import_all()
    path = list(sys.path)
    forked = Forks(socket.socket(fileno=int(sys.argv[1]))).serve()
    if forked is None:
        return
    request, connection = forked
    spare = Spare()
    if spare.request:
        connection.close()
        # What runs as a script was imported, by pytest's finder, which knows no scripts.
        sys.modules.pop(JUDGE[1], None)
        sys.meta_path[:] = [each for each in sys.meta_path if isinstance(each, type)]
        run(spare.request, path)
        return
    WarmPopen.spare = spare
    vars(subprocess)["Popen"] = WarmPopen
    WarmPopen.server = Server(connection, os.environ)
    run(request, path)


if __name__ == "__main__":
    main()
