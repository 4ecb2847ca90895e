"""``ExternalProgram``: a landing system that is a program of any language."""

from __future__ import annotations

import platform
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from pytest_garl.airframe import Airframe, airframe_of
from pytest_garl.errors import LandingSystemError
from pytest_garl.external import protocol
from pytest_garl.external.child import Child
from pytest_garl.external.frame_memory import FrameMemory
from pytest_garl.landing_system import Command, Mission, Observation
from pytest_garl.messages import printable, shown
from pytest_garl.program import ProgramSystem, identifier_of

T = TypeVar("T")
INTERPRETER = re.compile(r"(python|ruby|perl|node|java|lua|env|sh|bash|nice|ros2|stdbuf)[\d.]*")
"""What runs the program that gives a command its name."""


class ExternalProgram(ProgramSystem):
    """A program that gets each camera frame on stdin and answers with a command on stdout.

    ``command`` is the program with its arguments, as of ``subprocess.run``; paths in it begin at
    ``folder``, by default the folder of the module that makes this object, and it runs there.
    ``name`` is its id in ledgers, cases and baselines: by default the name of the first file in the
    command.  ``sources`` are patterns of the files that decide how it flies: if they change, saved
    cases are flown anew; by default all files in the folder.  ``environment`` adds to that of
    pytest.  It is made at the top level of a module::

        lander = ExternalProgram(["./lander"], airframe=Airframe(camera=Camera(rate_hz=20)))
        pytestmark = pytest.mark.garl(system=lander)

    ``docs/protocol.md`` says what the program reads and writes.  Raises LandingSystemError for a
    value that is not valid.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        name: str | None = None,
        airframe: Airframe | None = None,
        sources: Sequence[str] = (),
        folder: str | Path | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        if isinstance(command, str) or not command or not all(isinstance(c, str) for c in command):
            raise LandingSystemError(
                f"ExternalProgram({shown(command)}): expected a list of words, as ['./lander', "
                "'--fast']"
            )
        own = name if name is not None else _name_of(command)
        super().__init__(
            own,
            folder=folder,
            sources=sources,
            airframe=airframe or Airframe(),
            environment=environment,
        )
        self.command = tuple(command)
        self.settings = (self.command, tuple(sorted(self.environment.items())))

    def check(self) -> None:
        """Raise LandingSystemError if its program is not there, or its airframe cannot be flown."""
        if platform.system() != "Linux":
            raise LandingSystemError(
                f"{self.name}: an ExternalProgram flies on Linux only; a class flies elsewhere too"
            )
        word = self.command[0]
        found = self.folder / word if "/" in word else shutil.which(word)
        if found is None or not Path(found).exists():
            where = f"in {self.folder}" if "/" in word else "on the PATH"
            hint = "; build it first" if "/" in word else ""
            near = f"; did you mean ./{word}?" if (self.folder / word).is_file() else ""
            raise LandingSystemError(
                f"{self.name}: there is no program {word!r} {where}{near or hint}"
            )
        if shutil.which(found) is None:
            raise LandingSystemError(
                f"{self.name}: {word!r} is no executable file; expected a program (chmod +x), or "
                f"the one that runs it before it, as ['python3', {word!r}]"
            )
        script = next((each for each in self.command[1:] if each[:1] != "-"), "")
        if script.endswith(".py") and not (self.folder / script).is_file():
            raise LandingSystemError(f"{self.name}: there is no file {script!r} in {self.folder}")
        if airframe_of(self).control_rate_hz is not None:
            raise LandingSystemError(
                f"{self.name}: Airframe(control_rate_hz=...) is for classes with control(state); "
                "a program answers with position, velocity, attitude, land or abort"
            )

    def __call__(self) -> RunningProgram:
        """Start the program for one flight."""
        return RunningProgram(self)


class RunningProgram:
    """The program in one flight; a further ``reset`` starts it anew.

    ``reset`` and ``step`` raise ProgramFailedError if the program ends, or breaks the protocol.
    """

    def __init__(self, program: ExternalProgram) -> None:
        self._program = program
        self._child: Child | None = None
        self._memory: FrameMemory | None = None
        self._hello = protocol.Hello()
        self._frame = 0

    @property
    def needs_camera(self) -> bool:
        """Whether it reads a picture; known after ``reset``."""
        return bool(self._hello.planes)

    def reset(self, mission: Mission) -> None:
        """Start the program, tell it its mission, and wait until it is ready."""
        self.close()
        program, self._frame = self._program, 0
        self._child = Child(
            program.name, program.command, program.folder, program.environment, program.output
        )
        self._hello = self._ask("hello", protocol.hello_line(), protocol.read_hello)
        self._memory = FrameMemory(airframe_of(program).camera, self._hello.planes)
        line = protocol.reset_line(mission, self._hello, self._memory.facts)
        self._ask("reset", line, protocol.read_ready)

    def step(self, observation: Observation) -> Command:
        """Show the program a frame and return its command."""
        number, self._frame = self._frame, self._frame + 1
        assert self._memory is not None
        for name in self._hello.planes:
            self._memory.write(name, getattr(observation, name))
        line = protocol.step_line(number, observation, self._hello)
        return self._ask(
            f"step, frame {number}",
            line,
            lambda answer: protocol.read_command(answer, number, self._hello),
        )

    def close(self) -> None:
        """End the program."""
        if self._child is not None:
            self._child.close()
        if self._memory is not None:
            self._memory.close()
        self._child = self._memory = None

    def _ask(self, what: str, line: bytes, read: Callable[[bytes], T]) -> T:
        assert self._child is not None
        try:
            return read(self._child.ask(line, what))
        except protocol.BadMessageError as error:
            text = f"at {what}: {printable(str(error))}"
            raise self._child.failure(error.error, text, "nonsense") from None


def _name_of(command: Sequence[str]) -> str:
    """Return the name of what a command runs, without the interpreter that runs it."""
    words = [word for word in command if not word.startswith("-")]
    own = [word for word in words if not INTERPRETER.fullmatch(Path(word).name)] or words
    files = [word for word in own if "/" in word or Path(word).suffix]
    return identifier_of(Path((files or own or command)[0]).stem)
