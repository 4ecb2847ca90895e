"""A landing system that is a program: an object in place of a class, as ``system=`` of a test.

The object says how the program is started; each call of it makes what flies, with ``reset`` and
``step``.  It is made at the top level of a module, because a worker process imports that module to
find it again: "module:name" is its id in ledgers, cases and baselines, as of a class.
"""

from __future__ import annotations

import abc
import hashlib
import os
import re
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path
from types import FrameType
from typing import Any, Literal

from pytest_garl.airframe import Airframe
from pytest_garl.errors import LandingSystemError

MOST_SOURCES = 2_000
"""A program's folder with more files holds something else than its sources."""
MOST_OUTPUT = 2**24
"""Bytes of a program's output that are kept: a flood must not fill the disk."""
MOST_TAIL = 2**14
NO_SOURCES = ("test_*.py", "conftest.py", "*.pyc", "*.log")
NO_SOURCE_FOLDERS = ("__pycache__", "node_modules", "scenarios")
"""What lies beside a program and is none of its sources: tests, caches, and saved cases."""
_PACKAGE = __name__.partition(".")[0]
_made: dict[tuple[str, str], ProgramSystem] = {}
"""The programs of the modules that this process has imported."""


class ProgramSystem(abc.ABC):
    """Base of the landing systems that are programs.

    ``name`` is an identifier, ``folder`` is where its relative paths begin (by default that of the
    module that makes it), ``sources`` are patterns of files below ``folder``, of which an empty
    tuple means all files in ``home``, without tests and caches, and ``environment`` adds to the
    environment of pytest.  A subclass sets ``settings``: all that decides how it flies besides its
    sources, in a form whose ``repr`` is the same in every process.  Raises LandingSystemError for a
    value that is not valid, and for a second program of the same name in a module.
    """

    __name__: str
    __qualname__: str
    airframe: Airframe
    settings: tuple[object, ...] = ()

    output: ProgramOutput | None = None
    """Keeps what the program prints in its flights; None keeps none."""

    def __init__(
        self,
        name: str,
        *,
        folder: str | Path | None,
        sources: Sequence[str],
        airframe: Airframe,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.environment = dict(environment or {})
        for key, value in self.environment.items():
            if not isinstance(key, str) or not isinstance(value, str):
                raise LandingSystemError(
                    f"{name}: environment has {key!r}: {value!r}; expected texts, as 'SPEED': '2'"
                )
        if isinstance(sources, str) or not all(isinstance(each, str) for each in sources):
            raise LandingSystemError(
                f"{name}: sources={sources!r}: expected a list of patterns, as ['lander/**/*.py']"
            )
        if not re.fullmatch(r"[^\W\d]\w*", name):
            raise LandingSystemError(
                f"name={name!r}: expected a name of letters, digits and _ for the program; it is "
                "its id in saved cases"
            )
        namespace = _making_module()
        module, file = (str(namespace.get(each, "")) for each in ("__name__", "__file__"))
        self.name = self.__name__ = self.__qualname__ = name
        self.__module__, self.module_file, self._namespace = module, file, namespace
        known = _made.get((module, name))
        if module and known is not None and known._namespace is namespace:
            raise LandingSystemError(
                f"{module} makes two programs with the name {name!r}, which is their id in saved "
                "cases; give one of them another name="
            )
        beside = Path(file).parent if file else Path.cwd()
        self.folder = (beside / folder if folder else beside).resolve()
        self.home = self.folder
        self.sources = tuple(sources)
        self.airframe = airframe
        _made[module, name] = self

    @abc.abstractmethod
    def __call__(self) -> Any:
        """Return what flies: a landing system with ``reset``, ``step`` and ``close``."""

    @abc.abstractmethod
    def check(self) -> None:
        """Raise LandingSystemError if it cannot be started; called when tests are collected."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"

    def check_place(self) -> None:
        """Raise LandingSystemError if a worker process cannot find it by its name."""
        if not self.__module__:
            raise LandingSystemError(
                f"the program {self.name} is made inside a function; worker processes import the "
                "module that makes it, so make it at the module's top level"
            )

    def source_hashes(self) -> dict[str, str]:
        """Return the hashes of its source files and of its settings, by name.

        A file's name is its path from ``folder``, never an absolute one.  Raises LandingSystemError
        if a pattern matches no file, or if there are too many files.
        """
        found = {}
        for file in self._source_files():
            with file.open("rb") as stream:
                found[Path(os.path.relpath(file, self.folder)).as_posix()] = hashlib.file_digest(
                    stream, "sha256"
                ).hexdigest()
        settings = repr((type(self).__name__, self.airframe, self.settings))
        found[f"the settings of {self.name}"] = hashlib.sha256(settings.encode()).hexdigest()
        return found

    def _source_files(self) -> list[Path]:
        if not self.sources:
            files = [*_files_in(self.home)]
        else:
            files = sorted({file for each in self.sources for file in self._matching(each)})
        if len(files) > MOST_SOURCES:
            raise LandingSystemError(
                f"{self.name}: its sources are {len(files)} files in {self.home}; expected at most "
                f"{MOST_SOURCES}. Name those that decide how it flies: sources=['lander/**/*.py']"
            )
        return files

    def _matching(self, pattern: str) -> list[Path]:
        if Path(pattern).is_absolute():
            raise LandingSystemError(
                f"{self.name}: sources={pattern!r}: expected a path from {self.folder}"
            )
        found = [file for file in self.folder.glob(pattern) if file.is_file()]
        if not found:
            raise LandingSystemError(
                f"{self.name}: sources={pattern!r}: no file in {self.folder} matches"
            )
        return found


class ProgramOutput:
    """A file with what a program prints in its flights, up to ``MOST_OUTPUT`` bytes."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._room = MOST_OUTPUT
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b"")

    def write(self, data: bytes) -> None:
        """Append what was printed; of a flood the first part."""
        if kept := data[: self._room]:
            self._room -= len(kept)
            with self.file.open("ab") as opened:
                opened.write(kept)

    def last_lines(self, count: int) -> list[str]:
        """Return the last lines that are not empty."""
        text = self.file.read_bytes()[-MOST_TAIL:].decode(errors="replace")
        return [line.rstrip() for line in text.splitlines() if line.strip()][-count:]


class ProgramFailedError(Exception):
    """A program failed in a flight.

    ``error`` is the kind of it in a signature, ``where`` the place in the program, ``trace`` its
    own traceback, ``kind`` that of the flight's ``Crash``.
    """

    def __init__(
        self,
        error: str,
        message: str,
        *,
        where: str,
        trace: str = "",
        kind: Literal["raised", "nonsense", "died"] = "raised",
    ) -> None:
        super().__init__(message)
        self.error, self.message, self.where, self.trace = error, message, where, trace
        self.kind = kind


AnySystem = type | ProgramSystem
"""What may stand as ``system=`` of a test."""


def program_named(module: str, name: str) -> ProgramSystem | None:
    """Return the program that a module of this process has made; None if it has made none."""
    return _made.get((module, name))


def identifier_of(text: str) -> str:
    """Return a name of letters, digits and _ for what a command runs."""
    name = "".join(char if char.isalnum() else "_" for char in text)
    return name if name[:1].isalpha() or name[:1] == "_" else f"_{name}"


def end_in_words(status: int) -> tuple[str, str]:
    """Return how a process ended, as a signature and as a sentence have it."""
    if status >= 0:
        return f"exit-status-{status}", f"exit status {status}"
    known = -status in {*signal.Signals}
    name = f" ({signal.Signals(-status).name})" if known else ""
    return f"signal-{-status}", f"signal {-status}{name}"


def _making_module() -> dict[str, Any]:
    """Return the namespace of the module whose import makes a program; an empty one if none does.

    Below a test function stands a module too, that of pytest's own start, and imports nothing.
    """
    frame: FrameType | None = sys._getframe(1)
    direct = True
    while frame is not None:
        name = str(frame.f_globals.get("__name__", ""))
        if name.partition(".")[0] != _PACKAGE:
            is_import = name in sys.modules and (direct or name != "__main__")
            if frame.f_code.co_name == "<module>" and is_import:
                return frame.f_globals
            direct = False
        frame = frame.f_back
    return {}


def _files_in(folder: Path) -> Iterator[Path]:
    """Yield the files of a program's folder, without tests, caches and virtual environments."""
    for place, folders, names in os.walk(folder):
        if "pyvenv.cfg" in names and Path(place) != folder:
            folders.clear()
            continue
        folders[:] = sorted(
            each for each in folders if each[0] != "." and each not in NO_SOURCE_FOLDERS
        )
        for name in sorted(names):
            if name[0] != "." and not any(fnmatch(name, each) for each in NO_SOURCES):
                yield Path(place, name)
