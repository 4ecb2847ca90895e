"""``CompanionProgram``: the Python program that flies the real vehicle, unchanged."""

from __future__ import annotations

import dataclasses
import functools
import shlex
import shutil
import string
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, get_args

from pytest_garl.airframe import MAX_RATE_HZ, Airframe, Camera, airframe_of
from pytest_garl.companion.companion_flight import CompanionFlight, Start, mission_facts
from pytest_garl.errors import LandingSystemError
from pytest_garl.messages import listed, shown
from pytest_garl.program import ProgramSystem, identifier_of
from pytest_garl.vehicle.autopilot import ArduCopter
from pytest_garl.vehicle.mavlink import dialect
from pytest_garl.vehicle.px4 import Px4Copter

OLDEST = (3, 9)
"""Version of Python from which on a program can fly."""
Windows = Literal["refuse", "ignore"]


class CompanionProgram(ProgramSystem):
    """A Python program that speaks MAVLink with an autopilot, in the time of the flight.

    ``command`` is the line that starts it: ``"python my_lander.py --connect udp:0.0.0.0:14550"``,
    or ``python -m package``.  Words in braces are replaced by facts of the mission:
    ``{marker_id}``,
    ``{marker_side_m}``, ``{marker_dictionary}``, ``{lat_deg}``, ``{lon_deg}``, ``{north_m}``,
    ``{east_m}`` (the mission's coordinate), ``{search_altitude_m}``, ``{width_px}``,
    ``{height_px}``, ``{focal_px}``.  Paths begin at ``folder``, by default the folder of the module
    that makes this object, and the program runs there.

    ``camera`` is what ``cv2.VideoCapture`` shows, ``vehicle`` what it commands.  ``airframe`` has
    more of the vehicle, such as a rangefinder; its camera counts if ``camera`` is not given.
    ``python`` is the Python of another virtual environment.  With ``windows="ignore"`` a window
    that it opens is not shown, instead of an error.  ``name`` is its id in ledgers, cases and
    baselines, by default that of the script.  ``sources`` are patterns of the files that decide how
    it flies, by default all in the script's folder; ``environment`` adds to that of pytest.
    Raises LandingSystemError for a value that is not valid.

    It is made at the top level of a module::

        lander = CompanionProgram("python my_lander.py", camera=Camera(width_px=640, height_px=480))
        pytestmark = pytest.mark.garl(system=lander)
    """

    def __init__(
        self,
        command: str,
        *,
        camera: Camera | None = None,
        vehicle: ArduCopter | Px4Copter | None = None,
        airframe: Airframe | None = None,
        python: str | Path | None = None,
        windows: Windows = "refuse",
        name: str | None = None,
        folder: str | Path | None = None,
        sources: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
    ) -> None:
        if not isinstance(command, str) or not command.strip():
            raise LandingSystemError(
                f"CompanionProgram({shown(command)}): expected the line that starts the program, "
                "as 'python my_lander.py'"
            )
        if windows not in get_args(Windows):
            raise LandingSystemError(
                f"CompanionProgram(windows={windows!r}): expected {listed(get_args(Windows))}"
            )
        if vehicle is not None and not isinstance(vehicle, ArduCopter | Px4Copter):
            raise LandingSystemError(
                f"CompanionProgram(vehicle={shown(vehicle)}): expected ArduCopter(...) or "
                "Px4Copter(...)"
            )
        first, self.arguments = _parsed(command)
        plain = airframe or Airframe()
        super().__init__(
            name if name is not None else _name_of(self.arguments),
            folder=folder,
            sources=sources,
            airframe=dataclasses.replace(
                plain, camera=camera or plain.camera, control_rate_hz=MAX_RATE_HZ
            ),
            environment=environment,
        )
        self.vehicle: ArduCopter | Px4Copter = vehicle or ArduCopter()
        self.python, self.windows = str(python or first), windows
        script = self.folder / self.arguments[0]
        if script.suffix == ".py":
            self.home = script.resolve().parent
        self.settings = (
            command,
            type(self.vehicle).__name__,
            dataclasses.astuple(self.vehicle),
            windows,
            tuple(sorted(self.environment.items())),
        )

    def check(self) -> None:
        """Raise LandingSystemError if the script, its Python or pymavlink are not there."""
        script = self.arguments[0]
        if script != "-m" and not (self.folder / script).is_file():
            raise LandingSystemError(
                f"{self.name}: there is no file {script!r} in {self.folder}; paths of a "
                "CompanionProgram begin there, or at its folder="
            )
        python = self._interpreter()
        version = _version_of(python) if python is not None else None
        if version is None or version < OLDEST:
            version_text = ".".join(map(str, version or ()))
            found = f"found Python {version_text} as" if version else "there is no Python"
            raise LandingSystemError(
                f"{self.name}: {found} {self.python!r}; expected 3.9 or later, as that of a "
                "virtual environment: python='venv/bin/python'"
            )
        if airframe_of(self).control_rate_hz != MAX_RATE_HZ:
            raise LandingSystemError(f"{self.name}: its airframe was changed")
        known = {*mission_facts(None, self.airframe.camera)}
        for word in self.arguments:
            try:
                asked = {field for _, field, _, _ in string.Formatter().parse(word) if field}
            except ValueError:
                continue  # Braces of its own, as those of JSON.
            if asked - known and all(field.isidentifier() for field in asked):
                raise LandingSystemError(
                    f"{self.name}: {word!r}: found {{{min(asked - known)}}}, expected one of "
                    f"{listed(sorted(known))}; a brace of the program's own is written twice"
                )
        dialect()

    def _interpreter(self) -> str | None:
        if self.python in ("python", "python3"):
            return sys.executable
        if "/" in self.python:
            file = (self.folder / self.python).absolute()
            return str(file) if file.is_file() else None
        return shutil.which(self.python)

    def __call__(self) -> CompanionFlight:
        """Return what flies: the program and its autopilot."""
        return CompanionFlight(
            Start(
                name=self.name,
                python=self._interpreter() or self.python,
                arguments=self.arguments,
                folder=self.folder,
                environment=self.environment,
                windows=self.windows,
                output=self.output,
            ),
            airframe_of(self),
            self.vehicle,
        )


@functools.cache
def _version_of(python: str) -> tuple[int, ...] | None:
    """Return the version of a Python, (3, 11); None for what is none."""
    ask = "import sys; print('%d.%d' % sys.version_info[:2])"
    try:
        said = subprocess.run([python, "-c", ask], capture_output=True, text=True, timeout=30)
        return tuple(int(each) for each in said.stdout.split("."))
    except (OSError, ValueError, subprocess.SubprocessError):
        return None


def _parsed(command: str) -> tuple[str, tuple[str, ...]]:
    """Return the Python and the arguments of a line, which begin with the script, or with -m."""
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise LandingSystemError(f"CompanionProgram({command!r}): {error}") from error
    python = "python"
    if words and Path(words[0]).name.startswith("python"):
        python, *words = words
        while words and words[0] in ("-u", "-B", "-O"):
            words = words[1:]
    has_module = len(words) > 1 and words[0] == "-m"
    if not words or not (has_module or words[0].endswith(".py")):
        raise LandingSystemError(
            f"CompanionProgram({command!r}): expected a Python script, as 'python my_lander.py', "
            "or 'python -m package'; a program of another language is an ExternalProgram([...])"
        )
    return python, tuple(words)


def _name_of(arguments: Sequence[str]) -> str:
    return identifier_of(arguments[1] if arguments[0] == "-m" else Path(arguments[0]).stem)
