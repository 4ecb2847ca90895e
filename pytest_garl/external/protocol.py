"""The lines between pytest-garl and a program: requests and answers, in version 1.

``docs/protocol.md`` describes them for authors of the other side.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pytest_garl.airframe import Camera
from pytest_garl.commands import (
    Abort,
    AttitudeSetpoint,
    Command,
    Detection,
    Diagnostics,
    Land,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.external.axes import turned_attitude, turned_vector, turned_yaw
from pytest_garl.files.json_values import parse_json
from pytest_garl.landing_system import Mission, Observation
from pytest_garl.messages import listed, shown

VERSION = 1
FRAMES = ("ENU", "NED")
PLANES = ("image", "depth_m")
READABLE = (*PLANES, "rangefinder_m")
"""What a program may say that it reads; the rest of an observation it gets in any case."""
COMMANDS: dict[str, type[Any]] = {
    "position": PositionSetpoint,
    "velocity": VelocitySetpoint,
    "attitude": AttitudeSetpoint,
    "land": Land,
    "abort": Abort,
}
_TURNS: dict[str, Callable[[Any], Any]] = {
    "position_m": turned_vector,
    "velocity_mps": turned_vector,
    "attitude": turned_attitude,
    "yaw_rad": turned_yaw,
    "gps_position_m": turned_vector,
    "home_m": turned_vector,
    "target_m": turned_vector,
}
"""The values that differ in NED, by their names."""


class BadMessageError(Exception):
    """A line of a program that is no answer; ``error`` is the short name in a signature."""

    def __init__(self, message: str, error: str = "BadMessage") -> None:
        super().__init__(message)
        self.error = error


@dataclass(frozen=True, slots=True, kw_only=True)
class Hello:
    """What a program said of itself: its frame, and the data that it reads."""

    frame: str = "ENU"
    reads: tuple[str, ...] = ("image",)

    @property
    def planes(self) -> tuple[str, ...]:
        """The pictures that it reads."""
        return tuple(name for name in PLANES if name in self.reads)


def hello_line() -> bytes:
    """Return the first request."""
    return _line({"type": "hello", "protocol": VERSION})


def read_hello(line: bytes) -> Hello:
    """Return the answer to the first request; raise BadMessageError for another version."""
    answer = _read(line, "hello")
    version = answer.get("protocol")
    if version != VERSION:
        raise BadMessageError(
            f'speaks version {shown(version)} of the protocol; expected {VERSION}: answer "hello" '
            f'with "protocol": {VERSION}',
            "OtherProtocol",
        )
    _only(answer, ("protocol", "frame", "reads"), "hello")
    frame, reads = answer.get("frame", "ENU"), answer.get("reads", ["image"])
    if frame not in FRAMES:
        raise BadMessageError(f"hello: frame = {shown(frame)}; expected {' or '.join(FRAMES)}")
    if not isinstance(reads, list) or not all(each in READABLE for each in reads):
        raise BadMessageError(
            f"hello: reads = {shown(reads)}; expected a list of {listed(READABLE)}"
        )
    return Hello(frame=frame, reads=tuple(reads))


def reset_line(mission: Mission, hello: Hello, memory: dict[str, Any]) -> bytes:
    """Return the request that begins a flight."""
    facts = _turned(dataclasses.asdict(mission), hello)
    facts["camera"] = _camera(mission.camera, hello)
    return _line({"type": "reset", **facts, "memory": memory})


def _camera(camera: Camera, hello: Hello) -> dict[str, Any]:
    facts = dataclasses.asdict(camera)
    if hello.frame == "NED":
        x, y, z = camera.offset_m
        # In the body: to the right and down, not to the left and up.
        facts |= {"yaw_rad": -camera.yaw_rad, "offset_m": (x, -y, -z)}
    return {**facts, "focal_px": camera.focal_px, "centre_px": camera.centre_px}


def read_ready(line: bytes) -> None:
    """Check the answer to ``reset``; raise BadMessageError if it is another."""
    _only(_read(line, "ready"), (), "ready")


def step_line(number: int, observation: Observation, hello: Hello) -> bytes:
    """Return the request for a command; its pictures lie in the memory."""
    facts: dict[str, Any] = {
        "time_s": observation.time_s,
        "position_m": observation.position_m.tolist(),
        "velocity_mps": observation.velocity_mps.tolist(),
        "attitude": observation.attitude.tolist(),
    }
    if "rangefinder_m" in hello.reads:
        facts["rangefinder_m"] = observation.rangefinder_m
    return _line({"type": "step", "frame": number, **_turned(facts, hello)})


def read_command(line: bytes, number: int, hello: Hello) -> Command:
    """Return the command in an answer; raise BadMessageError if it is none.

    The receiver of the command checks the numbers, as it checks those of a class.
    """
    answer = _read(line, *COMMANDS)
    if answer.get("frame") != number:
        found = f'"frame": {shown(answer["frame"])}' if "frame" in answer else 'no "frame"'
        raise BadMessageError(f'answered {found}; expected "frame": {number}, as in the request')
    name = answer.pop("type")
    del answer["frame"]
    kind = COMMANDS[name]
    _only(answer, [each.name for each in dataclasses.fields(kind)], name)
    said = _read_diagnostics(answer.pop("diagnostics", None), hello)
    try:
        command: Command = kind(**_plain(_turned(answer, hello)), diagnostics=said)
    except TypeError as error:
        required = [each.name for each in dataclasses.fields(kind) if _is_required(each)]
        raise BadMessageError(
            f"{name}: found {listed(answer) or 'no fields'}; expected {listed(required)}"
        ) from error
    return command


def _read_diagnostics(value: Any, hello: Hello) -> Any:
    if not isinstance(value, dict):
        return value
    _only(value, [each.name for each in dataclasses.fields(Diagnostics)], "diagnostics")
    fields = _plain(_turned(value, hello))
    for name in ("planned_path_m", "obstacles_m"):
        if isinstance(points := fields.get(name), tuple) and hello.frame == "NED":
            fields[name] = tuple(turned_vector(each) for each in points)
    if isinstance(seen := fields.get("detections"), tuple):
        fields["detections"] = tuple(_read_detection(each, hello) for each in seen)
    return Diagnostics(**fields)


def _read_detection(value: Any, hello: Hello) -> Any:
    if not isinstance(value, dict):
        return value
    names = [each.name for each in dataclasses.fields(Detection)]
    _only(value, names, "diagnostics.detections")
    try:
        return Detection(**_plain(_turned(value, hello)))
    except TypeError as error:
        raise BadMessageError(
            f"diagnostics.detections: found {listed(value) or 'nothing'}; expected "
            f"{listed(names[:-1])} in each"
        ) from error


def _turned(facts: dict[str, Any], hello: Hello) -> dict[str, Any]:
    """Return the facts in the other frame if the program flies in NED."""
    if hello.frame == "ENU":
        return facts
    return {key: _TURNS[key](value) if key in _TURNS else value for key, value in facts.items()}


def _plain(fields: dict[str, Any]) -> dict[str, Any]:
    """Return the fields with tuples in place of lists, as the dataclasses have them."""
    return {key: _tuples(value) for key, value in fields.items()}


def _tuples(value: Any) -> Any:
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value


def _is_required(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _line(message: dict[str, Any]) -> bytes:
    return json.dumps(message, allow_nan=False).encode()


def _read(line: bytes, *types: str) -> dict[str, Any]:
    """Return a message of one of the types; raise BadMessageError for anything else."""
    expected = " or ".join(types)
    try:
        message = parse_json(line.decode())
    except UnicodeDecodeError as error:
        raise BadMessageError(
            f"wrote {_shown(line)}, whose byte {error.start} is not UTF-8; expected JSON in UTF-8"
        ) from None
    except ValueError as error:
        raise BadMessageError(
            f"wrote {_shown(line)} to stdout, where nothing but answers belongs ({error}); "
            f"expected a line of JSON of the type {expected}"
        ) from None
    if not isinstance(message, dict) or message.get("type") not in types:
        raise BadMessageError(
            f"wrote {_shown(line)}; expected a JSON object of the type {expected}"
        )
    return message


def _shown(line: bytes) -> str:
    return shown(line.decode(errors="replace"))


def _only(message: dict[str, Any], names: Any, what: str) -> None:
    unknown = [name for name in message if name != "type" and name not in names]
    if unknown:
        expected = f"expected {listed(names)}" if names else "expected no fields"
        raise BadMessageError(f"{what}: found {listed(unknown)}; {expected}")
