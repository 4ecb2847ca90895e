"""One flight of a companion program: its process, its autopilot, and the bytes between them."""

from __future__ import annotations

import contextlib
import json
import math
import selectors
import signal
import socket
import struct
import subprocess
import sys
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from pytest_garl.airframe import Airframe, Camera
from pytest_garl.distortion import undistorted
from pytest_garl.foreign_text import cut
from pytest_garl.landing_system import (
    Command,
    Detection,
    Diagnostics,
    Mission,
    MotorThrusts,
    Observation,
    VehicleState,
)
from pytest_garl.program import ProgramFailedError, ProgramOutput, end_in_words
from pytest_garl.program_process import ProgramProcess
from pytest_garl.vehicle.autopilot import ArduCopter
from pytest_garl.vehicle.mavlink import MavlinkLink
from pytest_garl.vehicle.ned import on_globe
from pytest_garl.vehicle.px4 import Px4Copter
from pytest_garl.vehicle.rotations import rotate

RUNNER = Path(__file__).with_name("inside") / "start.py"
EXCHANGES_HZ = 50.0
"""How often the program gets time and the vehicle's state between two frames."""
LINK_BY_S = 30.0
"""A program that has opened no link to the vehicle by then never will."""
MOST_MESSAGE = 2**24
"""Bytes of a message from the process: all that it may hold is cut before."""
TARGET_FOR_S = 1.0
"""For this time a landing target that the program sent counts as what it takes for the marker."""
QUIET_S: float | None = 1.5
STACK_S = 0.1
"""After the first wall time a program is asked where it is; within the second it must answer."""
ASKED = signal.SIGRTMAX - 1 if hasattr(signal, "SIGRTMAX") else signal.SIGUSR2
NOTE_CHARS = 900
FARTHEST_M = 100.0
_HEADER = struct.Struct("!cI")


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """How the process is started."""

    name: str
    python: str
    arguments: tuple[str, ...]
    folder: Path
    environment: Mapping[str, str]
    windows: str
    output: ProgramOutput | None = None
    """Where all that the program prints is kept."""


def mission_facts(mission: Mission | None, camera: Camera) -> dict[str, object]:
    """Return what may stand in braces in a command; without a mission only the names count."""
    east, north = mission.gps_position_m if mission else (0.0, 0.0)
    x, y, _ = mission.home_m if mission else (0.0, 0.0, 0.0)
    lat, lon = on_globe(east, north)
    return {
        "marker_id": mission.marker_id if mission else 0,
        "marker_side_m": mission.marker_side_m if mission else 0.0,
        "marker_dictionary": mission.marker_dictionary if mission else "",
        "lat_deg": f"{lat:.7f}",
        "lon_deg": f"{lon:.7f}",
        "north_m": f"{north - y:.3f}",
        "east_m": f"{east - x:.3f}",
        "search_altitude_m": mission.search_altitude_m if mission else 0.0,
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        "focal_px": f"{camera.focal_px:.4f}",
    }


class CompanionFlight:
    """A landing system: the program decides, the autopilot flies the motors.

    Calls raise ProgramFailedError if the program fails, sends what is no finite number, or leaves
    the vehicle without a link or a message.
    """

    def __init__(self, start: Start, airframe: Airframe, vehicle: ArduCopter | Px4Copter) -> None:
        self._start, self._airframe, self._vehicle = start, airframe, vehicle
        self._process: CompanionProcess | None = None

    def reset(self, mission: Mission) -> None:
        """Start the program for one flight."""
        self.close()
        self._autopilot = self._vehicle.autopilot(self._airframe, mission)
        self._outbox: list[bytes] = []
        self._link = MavlinkLink(self._autopilot, self._outbox.append)
        self._inbox: deque[tuple[float, bytes, str]] = deque()
        self._due_s = 0.0
        self._frames = 0
        self._observation: Observation | None = None
        self._seen: list[Detection] = []
        self._printed: list[str] = []
        self._process = CompanionProcess(self._start, self._airframe.camera, mission)

    def step(self, observation: Observation) -> Command:
        """Let the program look at a frame; return what the vehicle does, for the record."""
        self._observation = observation
        self._frames += 1
        self._link.rangefinder_m = observation.rangefinder_m
        if self._autopilot.state is not None:
            self._exchange()
        return self._autopilot.command(self._told(observation))

    def control(self, state: VehicleState) -> MotorThrusts:
        """Fly the motors for one control step; 50 times a second the program gets its time."""
        thrusts = self._autopilot.control(state)
        while self._inbox and self._inbox[0][0] <= state.time_s:
            _, data, line = self._inbox.popleft()
            self._link.receive(data)
            if self._link.nonsense:
                field, self._link.nonsense = self._link.nonsense, ""
                at = f" ({line})" if line else ""
                text = f"sent {field}; expected a finite number{at}"
                raise self._failure("BadMessage", text, kind="nonsense")
        if state.time_s >= self._due_s - 1e-9:
            self._due_s += 1 / EXCHANGES_HZ
            self._link.tell()
            self._exchange()
        return thrusts

    @property
    def returns_since_s(self) -> float | None:
        """Since when the vehicle returns home on command; None if it does not."""
        return self._autopilot.returns_since_s

    def close(self) -> None:
        """End the program."""
        if self._process is not None:
            self._process.close()
            self._process = None

    def _exchange(self) -> None:
        """Let the program run up to the present, with what the vehicle has sent."""
        process = self._process
        assert process is not None
        if process.ended:
            return
        now_s = self._autopilot.now.time_s
        answer = process.exchange(now_s, self._frames, b"".join(self._outbox), self._picture)
        self._outbox.clear()
        due_s = now_s + self._airframe.latency_s
        self._inbox.extend((due_s, data, line) for data, line in answer.sent)
        self._printed += [answer.printed] if answer.printed else []
        if self._observation is not None:
            self._seen += [
                _detection(number, corners, self._observation, self._airframe.camera)
                for number, corners in answer.found
            ]
        if answer.status == 0:
            self._printed.append("\nthe program has ended")
        if answer.failure is not None:
            raise self._failed(answer.failure)
        if answer.status:
            said = "".join(self._printed).strip()[-300:]
            end = f"; it said last: {said}" if said else ""
            raise self._failure(
                f"exit-status-{answer.status}",
                f"ended with exit status {answer.status} at {now_s:.1f} s of the flight{end}",
                kind="died",
            )
        if now_s > LINK_BY_S and not answer.links and answer.status is None:
            raise self._failure(
                "NoLink",
                f"has opened no link to the vehicle after {LINK_BY_S:g} s; expected MAVLink over "
                "UDP (as udp:0.0.0.0:14550), TCP (tcp:127.0.0.1:5760) or a serial port",
                kind="died",
            )

        idle = not self._link.heard and self._autopilot.landed and not self._vehicle.pilot
        if now_s > LINK_BY_S and idle and answer.status is None:
            raise self._failure(
                "NoMessage",
                f"has sent the vehicle nothing after {LINK_BY_S:g} s, and it stands on the ground; "
                "expected GUIDED, arming and a take-off. If your program waits for a pilot, give "
                "ArduCopter(pilot='LAND'), or start='hover' in the marker",
                kind="died",
            )

    def _picture(self) -> bytes:
        assert self._observation is not None
        return cv2.cvtColor(self._observation.image, cv2.COLOR_RGB2BGR).tobytes()

    def _told(self, observation: Observation) -> Diagnostics:
        """Return the diagnostics: nothing of it was said by the program for our sake."""
        seen, self._seen = self._seen, []
        pilot = self._autopilot
        fresh = observation.time_s - pilot.target_s < TARGET_FOR_S
        notes = []
        if seen:
            ids = ", ".join(str(each.marker_id) for each in seen[:20])
            notes.append(f"seen by its detector: {ids}")
        if self._printed:
            notes.append("".join(self._printed).strip())
        self._printed = []
        return Diagnostics(
            phase=pilot.phase,
            detections=tuple(seen[:100]),
            target_m=pilot.target_m if fresh else None,
            note=cut("\n".join(notes), NOTE_CHARS),
        )

    def _failed(self, failure: Mapping[str, str]) -> ProgramFailedError:
        message = f"{failure['message']} ({failure['line']})" if failure["line"] else ""
        missing = failure["error"] == "ModuleNotFoundError"
        hint = f"; install it for {self._start.python}, or name another python=" if missing else ""
        return ProgramFailedError(
            failure["error"],
            f"{message or failure['message']}{hint}",
            where=failure["where"] or self._start.name,
            trace=failure["trace"],
        )

    def _failure(self, error: str, message: str, *, kind: Any) -> ProgramFailedError:
        name = self._start.name
        return ProgramFailedError(error, f"{name} {message}", where=name, kind=kind)


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a program did in one exchange."""

    sent: list[tuple[bytes, str]]
    """What the program sent to the vehicle, and its line that did."""
    printed: str
    found: list[tuple[int, list[tuple[float, float]]]]
    links: int
    status: int | None
    """The exit status of a program that has come to its end."""
    failure: Mapping[str, str] | None


class CompanionProcess(ProgramProcess):
    """The process of a program; it runs only while ``exchange`` waits for it.

    ``ended`` is whether the program has come to its end.
    """

    def __init__(self, start: Start, camera: Camera, mission: Mission) -> None:
        facts = mission_facts(mission, camera)
        self._link, theirs = socket.socketpair()
        settings = {
            "link": theirs.fileno(),
            "arguments": [_filled(each, facts) for each in start.arguments],
            "windows": start.windows,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "rate_hz": camera.rate_hz,
        }
        self.ended = self._listens = self._has_begun = False
        with theirs:
            super().__init__(
                start.name,
                [start.python, str(RUNNER), json.dumps(settings)],
                start.folder,
                {"QT_QPA_PLATFORM": "offscreen", "TZ": "UTC", **start.environment},
                output=start.output,
                stdin=subprocess.DEVNULL,
                stderr=subprocess.STDOUT,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        self._ready.register(self._link, selectors.EVENT_READ)

    def exchange(self, until_s: float, frame: int, data: bytes, picture: Any) -> Answer:
        """Give the program time and bytes; return what it did until it waits for more.

        Raises ProgramFailedError if its process has ended, or wrote into the link between the two.
        """
        self._write(b"G", struct.pack("!dI", until_s, frame) + data)
        while True:
            kind, answer = self._read()
            if kind == b"D":
                self._has_begun = True
                break
            if kind == b"R":
                self._listens = True
            else:
                self._write(b"I", picture())
        with self._refusing_garbage():
            (size,) = struct.unpack_from("!I", answer)
            facts = json.loads(answer[4 : 4 + size])
            self.ended = "ended" in facts
            if self._output is not None:
                self._output.write(str(facts["printed"]).encode(errors="replace"))
            sent, senders = answer[4 + size :], facts["senders"]
            ends = [begin for begin, _ in (*senders, (len(sent), ""))][1:]
            return Answer(
                sent=[
                    (sent[begin:end], str(line))
                    for (begin, line), end in zip(senders, ends, strict=True)
                ],
                printed=str(facts["printed"]),
                found=[
                    (int(number), [(float(u), float(v)) for u, v in corners])
                    for number, corners in facts["found"]
                ],
                links=int(facts["links"]),
                status=int(facts["ended"]) if self.ended else None,
                failure=facts.get("failure"),
            )

    def close(self) -> None:
        """Kill the process, what it has started, and what is left of its group."""
        super().close()
        self._link.close()

    @contextlib.contextmanager
    def _refusing_garbage(self) -> Any:
        try:
            yield
        except (ValueError, KeyError, TypeError, struct.error) as error:
            raise self.failure(
                "BadMessage",
                f"wrote into the link between its process and the simulator ({error}); that "
                "file is not its own",
            ) from None

    def _write(self, kind: bytes, data: bytes) -> None:
        try:
            self._link.sendall(_HEADER.pack(kind, len(data)) + data)
        except OSError:
            raise self._died() from None

    def _read(self) -> tuple[bytes, bytes]:
        with self._refusing_garbage():
            kind, size = _HEADER.unpack(self._exactly(_HEADER.size))
            if kind not in (b"D", b"F", b"R") or size > MOST_MESSAGE:
                raise ValueError(f"a message of type {kind!r} and {size} bytes")
        return kind, self._exactly(size)

    def _exactly(self, size: int) -> bytes:
        data = b""
        quiet_s = QUIET_S
        while len(data) < size:
            ready = self.ready(quiet_s)
            if not ready and quiet_s is not None:
                quiet_s = None
                self._tell_where_it_is()
            if self._link.fileno() in ready:
                try:
                    part = self._link.recv(size - len(data))
                except OSError:
                    part = b""
                if not part:
                    raise self._died()
                data += part
        return data

    def _tell_where_it_is(self) -> None:
        """Say on stderr what the program computes: if it hangs, the report has that line.

        Before it has waited for the first time it starts up, which takes long for some imports.
        """
        if not self._listens:
            return  # It would end by the signal.
        self.read_said()
        # The stack that it writes is none of its own output.
        output, self._output = self._output, None
        self._process.send_signal(ASKED)
        self.ready(QUIET_S)
        time.sleep(STACK_S)
        self.read_said()
        self._output = output
        place = self._place()
        at = f", at {place}" if place else ""
        if self._has_begun:
            text = f"{self._name} computes without waiting for anything{at}"
        else:
            text = f"{self._name} is starting up{at}; it has not waited for the vehicle yet"
        sys.stderr.write(f"{text}\n")

    def _place(self) -> str:
        """Return where the program was, of the last stack of threads in what it wrote."""
        stack = self.said.rpartition("Current thread")[2]
        places = [line.strip() for line in stack.splitlines() if line.startswith("  File")]
        own = [each for each in places if str(RUNNER.parent) not in each]
        return own[0] if own else ""

    def _died(self) -> ProgramFailedError:
        status = self._process.wait()
        self.read_said()
        error, how = end_in_words(status)
        end = f"; it said last: {self.said[-300:]}" if self.said else ""
        if place := self._place():
            end = f", at {place}"
        return self.failure(error, f"ended in the flight with {how}{end}")


def _filled(word: str, facts: Mapping[str, object]) -> str:
    """Return an argument with the facts in its braces; as it is if the braces are its own."""
    try:
        return word.format(**facts)
    except (KeyError, IndexError, ValueError, AttributeError):
        return word


def _detection(
    number: int, corners: list[tuple[float, float]], observation: Observation, camera: Camera
) -> Detection:
    """Return a marker that the program's detector found, where its middle meets the ground."""
    u, v = (math.fsum(each) / max(1, len(corners)) for each in zip(*corners, strict=True))
    return Detection(
        marker_id=number if abs(number) < 2**31 else -1,
        confidence=1.0,
        position_m=_on_the_ground((u, v), observation, camera),
        corners_px=tuple(corners),
    )


def _on_the_ground(
    pixel: tuple[float, float], observation: Observation, camera: Camera
) -> tuple[float, float, float]:
    """Follow the ray of a pixel to the ground, or 100 m far if it does not meet the ground."""
    (cx, cy), focal = camera.centre_px, camera.focal_px
    place = np.array([[(pixel[0] - cx) / focal, (pixel[1] - cy) / focal]])
    straight = undistorted(place, camera.distortion) if camera.distortion else place
    right, back = (place if straight is None else straight)[0]
    forward, left = -float(back), -float(right)
    ct, st = math.cos(camera.tilt_rad), math.sin(camera.tilt_rad)
    cy_, sy_ = math.cos(camera.yaw_rad), math.sin(camera.yaw_rad)
    forward, up = ct * forward + st, st * forward - ct
    qx, qy, qz, qw = (float(each) for each in observation.attitude)
    attitude = (qx, qy, qz, qw)
    ray = (cy_ * forward - sy_ * left, sy_ * forward + cy_ * left, up)
    east, north, up = rotate(attitude, ray)
    x, y, z = np.asarray(observation.position_m) + rotate(attitude, camera.offset_m)
    x, y, z = float(x), float(y), float(z)
    far = min(z / -up, FARTHEST_M) if up < 0 else FARTHEST_M
    return x + far * east, y + far * north, z + far * up
