"""Python programs that the program starts by ``subprocess``: they run in the flight's time too.

A task carries each: it gives the other process time as the simulator gives it to this one, and
takes what it printed, sent and saw.  Another language runs in real time, at one moment of the
flight.
"""

from __future__ import annotations

import _socket
import json
import shlex
import socket
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

from .turns import refusing

RUNNER = str(Path(__file__).with_name("start.py"))
SLICE_S = 0.02
"""How often it gets time at least: frames and bytes of the vehicle wait no longer."""
_RealPopen: Any = subprocess.Popen
_real_pair: Any = _socket.socketpair


def python_words(command: Any, options: dict[str, Any]) -> list[str] | None:
    """Return the words of a command that runs a Python script or module; None for others."""
    if isinstance(command, (str, bytes, Path)):
        text = command.decode() if isinstance(command, bytes) else str(command)
        words = shlex.split(text) if options.get("shell") else [text]
    else:
        words = [str(each) for each in command]
    if len(words) < 2 or not Path(words[0]).name.startswith("python"):
        return None
    first = words.pop(0)
    while words and words[0] in ("-u", "-B"):
        words.pop(0)
    runs = bool(words) and (words[0].endswith(".py") or (words[0] == "-m" and len(words) > 1))
    python = sys.executable if first in ("python", "python3") else first
    return [python, *words] if runs else None


def install(host: Any, wire: Any) -> None:
    """Let ``subprocess`` start Python programs in the time of this host, each over a ``wire``."""
    turns, network, sight = host.turns, host.network, host.sight
    no_asyncio = refusing("starts a Python program by asyncio", "subprocess.Popen")

    class Popen(_RealPopen):  # type: ignore[misc]
        """A process; one that runs Python is carried by a task."""

        def __init__(self, command: Any, *more: Any, **options: Any) -> None:
            words = python_words(command, options)
            self._task: Any = None
            if words is None:
                super().__init__(command, *more, **options)
                return
            if sys._getframe(1).f_globals.get("__name__", "").startswith("asyncio"):
                no_asyncio()
            ours, theirs = _real_pair()
            self._wire = wire(ours)
            settings = {**host.settings, "link": theirs.fileno(), "arguments": words[1:]}
            kept = {name: options[name] for name in ("cwd", "env") if name in options}
            super().__init__(
                [words[0], RUNNER, json.dumps(settings)],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                **kept,
            )
            theirs.close()
            self._mail = bytearray()
            network.mailboxes.append(self._mail)
            self._out: Any = None
            if subprocess.PIPE in (options.get("stdout"), options.get("stderr")):
                ours, self._out = socket.socketpair()
                text = any(options.get(key) for key in ("text", "universal_newlines", "encoding"))
                reader = ours.makefile("r" if text else "rb")
                self.stdout = reader if options.get("stdout") == subprocess.PIPE else None
                self.stderr = reader if self.stdout is None else ours.makefile("rb")
            self._task = turns.spawn(self._carry, "process")

        def _carry(self) -> None:
            status = None
            try:
                while status is None:
                    status = self._exchange()
                    if status is None:
                        turns.park(turns.now_s + SLICE_S)
            except OSError:
                status = super().wait()
            super().kill()
            super().wait()
            self.returncode = status
            network.mailboxes.remove(self._mail)
            self._wire.close()
            if self._out is not None:
                self._out.close()

        def _exchange(self) -> int | None:
            data, self._mail[:] = bytes(self._mail), b""
            self._wire.write(b"G", struct.pack("!dI", turns.now_s, sight.number) + data)
            while (message := self._wire.read())[0] != b"D":
                if message[0] == b"F":
                    self._wire.write(b"I", sight.newest().tobytes())
            answer = bytes(message[1])
            (size,) = struct.unpack_from("!I", answer)
            facts = json.loads(answer[4 : 4 + size])
            network.transmit(answer[4 + size :])
            sight.found += [(number, corners) for number, corners in facts["found"]]
            host.links_opened = max(host.links_opened, facts["links"])
            if self._out is None:
                host.printed.write(facts["printed"])
            elif facts["printed"]:
                self._out.sendall(facts["printed"].encode())
            return (
                (facts["ended"] or int(facts["failure"] is not None)) if "ended" in facts else None
            )

        def poll(self) -> Any:
            if self._task is None:
                return super().poll()
            turns.pass_time(SLICE_S / 100)
            return self.returncode

        def wait(self, timeout: Any = None) -> Any:
            if self._task is None or turns.current is self._task:
                return super().wait(timeout)
            turns.join(self._task, None if timeout is None else turns.now_s + timeout)
            if not self._task.done:
                raise subprocess.TimeoutExpired(self.args, timeout)
            return self.returncode

        def communicate(self, input: Any = None, timeout: Any = None) -> Any:
            if self._task is None:
                return super().communicate(input, timeout)
            if timeout is not None:
                self.wait(timeout)
            out = self.stdout.read() if self.stdout else None
            self.wait(timeout)
            return out, (self.stderr.read() if self.stderr else None)

    changes: Any = subprocess
    changes.Popen = Popen
