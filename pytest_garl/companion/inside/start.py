"""Starts a companion program beneath simulated time; the simulator runs this file as a script."""

from __future__ import annotations

import faulthandler
import functools
import importlib.util
import io
import json
import os
import runpy
import signal
import socket
import struct
import sys
import traceback
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
NAME = "_garl_inside"
ASKED = signal.SIGRTMAX - 1 if hasattr(signal, "SIGRTMAX") else signal.SIGUSR2
"""The simulator's question where the program is, when it computes for long."""
HEADER = struct.Struct("!cI")
MOST_PRINTED = 2_000
"""Characters of what a program prints between two exchanges that are kept."""
MOST_FOUND = 50
"""Markers of one exchange that are told."""


def load_inside() -> Any:
    """Load this folder as a package under a name that no program has."""
    place = HERE / "__init__.py"
    spec = importlib.util.spec_from_file_location(
        NAME, place, submodule_search_locations=[str(HERE)]
    )
    assert spec is not None
    assert spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[NAME] = package
    spec.loader.exec_module(package)
    for each in ("offspring", "turns", "network", "sight"):
        importlib.import_module(f"{NAME}.{each}")
    return package


class Kept(io.BufferedIOBase):
    """What the program prints and writes as errors: in order, of a flood the first part."""

    name = "<stdout>"

    def __init__(self) -> None:
        self.texts: list[str] = []

    def write(self, data: Any) -> int:
        """Keep a text."""
        written = bytes(data)
        room = MOST_PRINTED - sum(map(len, self.texts))
        if room > 0:
            self.texts.append(written.decode("utf-8", "replace")[:room])
        return len(written)

    def fileno(self) -> int:
        """Return the number of the real stream, for other programs that are started."""
        return 1

    def writable(self) -> bool:
        """Return that one can write to it."""
        return True


class Wire:
    """Messages of a type and some bytes over a socket; OSError if the other end is gone."""

    def __init__(self, link: Any) -> None:
        self._link = link

    def write(self, kind: bytes, data: bytes = b"") -> None:
        """Send a message."""
        self._link.sendall(HEADER.pack(kind, len(data)) + data)

    def read(self) -> tuple[bytes, bytearray]:
        """Wait for a message."""
        kind, size = HEADER.unpack(self._exactly(HEADER.size))
        return kind, self._exactly(size)

    def _exactly(self, size: int) -> bytearray:
        data = bytearray(size)
        view = memoryview(data)
        while view:
            count = self._link.recv_into(view)
            if not count:
                raise OSError("the other end is gone")
            view = view[count:]
        return data

    def close(self) -> None:
        """Close the socket."""
        self._link.close()


class Host:
    """The simulator's end: asks it for more time, and for frames."""

    def __init__(self, wire: Wire, settings: dict[str, Any]) -> None:
        self._wire, self.settings = wire, settings
        self.turns = sys.modules[f"{NAME}.turns"].Turns(self.exchange)
        self.network = sys.modules[f"{NAME}.network"].Network(self.turns, line_of_program)
        self.sight = sys.modules[f"{NAME}.sight"].Sight(self.turns, self.frame, settings)
        self.kept = Kept()
        self.printed = io.TextIOWrapper(
            self.kept, encoding="utf-8", errors="replace", newline="", write_through=True
        )
        self.links_opened = 0

    def exchange(self) -> None:
        """Tell what the program did, and wait until the simulator has flown on."""
        self.tell({})
        self.get_time()

    def get_time(self) -> None:
        """Wait until the simulator has flown on."""
        kind, data = self._read()
        if kind != b"G":
            os._exit(0)
        until_s, number = struct.unpack("!dI", data[:12])
        self.turns.until_s = until_s
        mail = bytes(data[12:])

        def arrive() -> None:
            self.sight.arrived(number)
            self.network.deliver(mail)

        # Who is due before that has the turn first.
        self.turns.call_at(until_s, arrive)

    def tell(self, more: dict[str, Any]) -> None:
        """Write what the program did since the exchange before."""
        sent, self.network.outbox = bytes(self.network.outbox), bytearray()
        senders, self.network.senders = self.network.senders, []
        found, self.sight.found = self.sight.found[:MOST_FOUND], []
        printed, self.kept.texts = "".join(self.kept.texts), []
        self.links_opened = max(self.links_opened, len(self.network.to_vehicle))
        facts = {"printed": printed, "found": found, "links": self.links_opened}
        facts.update(senders=senders, **more)
        text = json.dumps(facts).encode()
        self._wire.write(b"D", struct.pack("!I", len(text)) + text + sent)

    def wait_for_the_end(self) -> None:
        """Read until the simulator closes the link: the last message may not be read yet."""
        while True:
            self._read()

    def frame(self) -> Any:
        """Return the newest frame as an array (H, W, 3), blue first."""
        import numpy as np

        self._wire.write(b"F")
        _, data = self._read()
        shape = self.settings["height_px"], self.settings["width_px"], 3
        return np.frombuffer(data, np.uint8).reshape(shape)

    def _read(self) -> tuple[bytes, bytearray]:
        try:
            return self._wire.read()
        except OSError:
            os._exit(0)  # The simulator is gone.


class Hooks:
    """Changes modules when the program has imported them."""

    def __init__(self, changes: dict[str, Callable[[Any], None]]) -> None:
        self._changes = changes
        self._busy: set[str] = set()

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """Return the specification of a module that is changed after its import."""
        # OpenCV imports itself, and a program may look for a module and import it later or never.
        if name not in self._changes or name in self._busy:
            return None
        self._busy.add(name)
        spec = importlib.util.find_spec(name)
        self._busy.discard(name)
        if spec is None or spec.loader is None:
            return None
        loader: Any = spec.loader
        execute = loader.exec_module

        def exec_module(module: Any) -> None:
            self._busy.add(name)
            execute(module)
            self._busy.discard(name)
            self._changes[name](module)

        loader.exec_module = exec_module
        return spec


def install(host: Host) -> None:
    """Put simulated time, network and camera beneath Python's library."""
    parts = ("turns", "network", "sight")
    turns, network, sight = (sys.modules[f"{NAME}.{each}"] for each in parts)
    turns.install(host.turns)
    network.install(host.network)
    sys.modules[f"{NAME}.offspring"].install(host, Wire)
    tags = {
        name: lambda module: sight.change_apriltag(module, host.sight)
        for name in ("apriltag", "dt_apriltags", "pupil_apriltags", "pyapriltags")
    }

    def mavsdk(module: Any) -> None:
        # It imports asyncio, which has to find the flight's time.
        importlib.import_module(f"{NAME}.mavsdk_system").change_mavsdk(module)

    def no_process(name: str) -> Any:
        return turns.refusing(f"calls multiprocessing's {name}", "threading.Thread, or subprocess")

    sys.meta_path.insert(
        0,
        Hooks(
            {
                "cv2": lambda module: sight.change_cv2(module, host.sight),
                "datetime": turns.change_datetime,
                "mavsdk": mavsdk,
                "mavsdk_grpc": mavsdk,
                "multiprocessing.process": lambda module: setattr(
                    module.BaseProcess, "start", no_process("Process.start")
                ),
                "multiprocessing.shared_memory": lambda module: setattr(
                    module.SharedMemory, "__init__", no_process("SharedMemory")
                ),
                "numpy": lambda module: module.random.seed(0),
                "serial": lambda module: network.serial_module(host.network, module),
                **tags,
            }
        ),
    )
    if importlib.util.find_spec("serial") is None:
        network.serial_module(host.network, None)
    _install_random()
    changes: Any = os
    for name in ("fork", "forkpty", "execv", "execve"):
        setattr(changes, name, turns.refusing(f"calls os.{name}", "a thread, or subprocess"))
    sys.stdout, sys.stderr = host.printed, host.printed
    sys.stdin = io.StringIO()


def _install_random() -> None:
    """Give random numbers without a seed the same ones in each flight."""
    import random

    random.seed(0)
    bits = random.Random(1)
    changes: Any = random
    seed = random.Random.seed
    changes.Random.seed = lambda self, a=None, version=2: seed(
        self, bits.getrandbits(64) if a is None else a, version
    )
    changes.seed = changes._inst.seed

    def urandom(size: int) -> bytes:
        return bits.getrandbits(8 * size).to_bytes(size, "big") if size else b""

    os.urandom = changes._urandom = urandom


def run(arguments: list[str]) -> None:
    """Run a script, or a module with -m, as Python does."""
    if arguments[0] == "-m":
        sys.argv = arguments[1:]
        sys.path.insert(0, str(Path.cwd()))
        runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
        return
    sys.argv = arguments
    sys.path.insert(0, str(Path(arguments[0]).resolve().parent))
    runpy.run_path(arguments[0], run_name="__main__")


def failure_of(error: BaseException) -> dict[str, Any]:
    """Return what is reported of an error that ended the program."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [each for each in frames if not _is_carrier(each.filename)]
    last = own[-1] if own else None
    inside = [each for each in own if each.line and not _is_library(each.filename)] or own
    if inside:
        last = inside[-1]
    lines = traceback.format_list(own) + traceback.format_exception_only(type(error), error)
    return {
        "error": type(error).__name__,
        "message": str(error),
        "where": f"{Path(last.filename).stem}.{last.name}" if last else "",
        "line": f"{Path(last.filename).name}, line {last.lineno}" if last else "",
        "trace": "".join(lines)[-20_000:],
    }


def line_of_program() -> str:
    """Return the program's own line that is running; a library's only if all is a library's."""
    frame: types.FrameType | None = sys._getframe(1)
    found = ""
    while frame is not None:
        name = frame.f_code.co_filename
        if not _is_carrier(name):
            if not _is_library(name):
                return f"{_file_name(name)}, line {frame.f_lineno}"
            found = found or f"{_file_name(name)}, line {frame.f_lineno}"
        frame = frame.f_back
    return found


@functools.cache
def _file_name(path: str) -> str:
    return Path(path).name


@functools.cache
def _is_library(name: str) -> bool:
    return "site-packages" in name or name.startswith(str(Path(os.__file__).parent))


@functools.cache
def _is_carrier(name: str) -> bool:
    return name.startswith((str(HERE), "<frozen")) or Path(name).name == "runpy.py"


def main() -> None:
    """Run the program, and tell how it ended."""
    faulthandler.enable(2)
    faulthandler.register(ASKED, 2)
    signal.siginterrupt(ASKED, False)
    settings = json.loads(sys.argv[1])
    wire = Wire(socket.socket(fileno=settings["link"]))
    wire.write(b"R")
    _end_with_parent()
    _limit_memory()
    sys.path[:] = [each for each in sys.path if Path(each or ".").resolve() != HERE]
    load_inside()
    host = Host(wire, settings)
    install(host)
    status: Any = 0
    failure: dict[str, Any] | None = None
    try:
        host.get_time()
        host.turns.now_s = host.turns.until_s
        run(settings["arguments"])
        _finish()
    except SystemExit as end:
        status = end.code
    except BaseException as error:  # noqa: BLE001 (whatever a program raises is told)
        failure = failure_of(error)
        host.printed.write(failure["trace"][-MOST_PRINTED:])
    if isinstance(status, str):
        host.printed.write(status)
    code = status if isinstance(status, int) else int(status is not None)
    host.tell({"ended": code, "failure": failure})
    host.wait_for_the_end()


def _finish() -> None:
    """Wait for threads that are no daemons, and run what shall run at the end."""
    import atexit
    import threading

    for call in reversed(getattr(threading, "_threading_atexits", ())):
        call()  # Of executors: their threads wait for it.
    for each in threading.enumerate():
        if each is not threading.current_thread() and not each.daemon:
            each.join()
    atexit._run_exitfuncs()


def _limit_memory() -> None:
    """Let a program without end to its memory fail, before the machine has none left."""
    import resource

    half = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if soft == resource.RLIM_INFINITY:
        resource.setrlimit(resource.RLIMIT_DATA, (half, hard))


def _end_with_parent() -> None:
    """Let the system end this process with the simulator's, where it can (Linux).

    It adopts its orphans, so that the simulator finds them below it and ends them.
    """
    import ctypes

    try:
        ctypes.CDLL(None).prctl(1, 9)
        ctypes.CDLL(None).prctl(36, 1)
    except AttributeError:
        return


if __name__ == "__main__":
    main()
