"""The link of a Python program to pytest-garl: one file, Python 3.8 or later, no dependencies.

    import garl_client

    link = garl_client.Link(frame="ENU", reads=["image"])
    x, y = link.mission["gps_position_m"]
    for seen in link:                                   # one camera frame after the other
        picture = seen.image                            # RGB, a NumPy array if NumPy is there
        link.position((x, y, 5.0), speed_mps=1.5)       # one command for each frame

The loop ends with the flight.  ``print`` goes to stderr, because stdout is the link.
docs/protocol.md of pytest-garl describes missions, observations and commands.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import mmap
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

PROTOCOL = 1


class Observation:
    """The readings of one camera frame; the pictures are there until the frame is answered."""

    def __init__(self, message: dict[str, Any], planes: dict[str, Any]) -> None:
        self.frame: int = message["frame"]
        self.time_s: float = message["time_s"]
        self.position_m: list[float] = message["position_m"]
        self.velocity_mps: list[float] = message["velocity_mps"]
        self.attitude: list[float] = message["attitude"]
        self.rangefinder_m: float | None = message.get("rangefinder_m")
        self._planes = planes

    @property
    def image(self) -> Any:
        """The picture, RGB, 8 bits, (height, width, 3)."""
        return self._planes["image"]

    @property
    def depth_m(self) -> Any:
        """The planar depth in metres, 32 bits, (height, width); 0 where nothing is measured."""
        return self._planes["depth_m"]


class Link:
    """The link of one flight; ``mission`` is the task, as the protocol describes it.

    ``frame`` is "ENU" (and FLU) or "NED" (and FRD), for all values read and sent.  ``reads`` names
    the data that the program uses: "image", "depth_m", "rangefinder_m".  Raises RuntimeError for
    a message that the protocol forbids, and for a frame without a command or with two.
    """

    def __init__(self, frame: str = "ENU", reads: Sequence[str] = ("image",)) -> None:
        self._requests = os.fdopen(os.dup(0), "rb")
        self._answers = os.dup(1)
        os.dup2(2, 1)
        self._frame: int | None = None
        self._read("hello")
        self._write({"type": "hello", "protocol": PROTOCOL, "frame": frame, "reads": list(reads)})
        self.mission: dict[str, Any] = self._read("reset") or {}
        self._planes = _planes(self.mission.get("memory"))

    def __iter__(self) -> Iterator[Observation]:
        """Yield the frames until the flight ends; each must be answered by one command."""
        self._write({"type": "ready"})
        while True:
            message = self._read("step")
            if message is None:
                return
            self._frame = message["frame"]
            yield Observation(message, self._planes)
            if self._frame is not None:
                raise RuntimeError(
                    f"frame {self._frame} got no command; call position, velocity, attitude, land "
                    "or abort once for each frame"
                )

    def position(self, position_m: Sequence[float], **fields: Any) -> None:
        """Fly to (x, y, z); fields: speed_mps, yaw_rad, acceleration_mps2, tilt_rad."""
        self.send("position", position_m=position_m, **fields)

    def velocity(self, velocity_mps: Sequence[float], **fields: Any) -> None:
        """Fly at (vx, vy, vz); field: yaw_rad."""
        self.send("velocity", velocity_mps=velocity_mps, **fields)

    def attitude(self, attitude: Sequence[float], thrust: float, **fields: Any) -> None:
        """Hold a quaternion (x, y, z, w) with a thrust from 0 to 1."""
        self.send("attitude", attitude=attitude, thrust=thrust, **fields)

    def land(self, **fields: Any) -> None:
        """Descend straight down; field: speed_mps.  The motors stop after the touchdown."""
        self.send("land", **fields)

    def abort(self, **fields: Any) -> None:
        """Give up: the vehicle climbs away.  It is the last command of a flight."""
        self.send("abort", **fields)

    def send(self, kind: str, **fields: Any) -> None:
        """Answer the frame; every command may have the field ``diagnostics``, a dict."""
        if self._frame is None:
            raise RuntimeError(
                "a command without a frame: before the first one, or a second one for it; expected "
                "one command for each frame"
            )
        self._write(dict(fields, type=kind, frame=self._frame))
        self._frame = None

    def _read(self, kind: str) -> dict[str, Any] | None:
        line = self._requests.readline()
        if not line:
            return None
        message: dict[str, Any] = json.loads(line.decode())
        if message["type"] != kind:
            raise RuntimeError(f"pytest-garl sent {message['type']!r}; expected {kind!r}")
        return message

    def _write(self, message: dict[str, Any]) -> None:
        rest = json.dumps(message, default=_plain).encode() + b"\n"
        while rest:
            rest = rest[os.write(self._answers, rest) :]


def _planes(memory: dict[str, Any] | None) -> dict[str, Any]:
    """Return the pictures in the shared memory, as NumPy arrays if NumPy is there."""
    if not memory:
        return {}
    with Path(memory["path"]).open("rb") as file:
        shared = mmap.mmap(file.fileno(), memory["bytes"], access=mmap.ACCESS_READ)
    numpy: Any = None
    with contextlib.suppress(ImportError):
        numpy = importlib.import_module("numpy")
    found: dict[str, Any] = {}
    for name in ("image", "depth_m"):
        if name not in memory:
            continue
        place = memory[name]
        count = 1
        for length in place["shape"]:
            count *= length
        if numpy is not None:
            flat = numpy.frombuffer(shared, place["type"], count, place["offset"])
            found[name] = flat.reshape(place["shape"])
        else:
            size = 1 if place["type"] == "uint8" else 4
            part = memoryview(shared)[place["offset"] : place["offset"] + count * size]
            shape = place["shape"]
            found[name] = part.cast("B", shape) if size == 1 else part.cast("f", shape)
    return found


def _plain(value: Any) -> Any:
    """Turn NumPy's arrays and numbers into those of JSON."""
    return value.tolist()
