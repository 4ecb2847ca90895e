"""Classes and functions by name, so that a worker process can load them."""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import inspect
import operator
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.engine import chosen
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.sources import code_sha256, flight_code_sha256
from pytest_garl.messages import shown
from pytest_garl.program import ProgramSystem, program_named

SYSTEM_NAME = re.compile(r"\w[\w-]*(\.\w[\w-]*)*:[^\W\d]\w*(\.[^\W\d]\w*)*")
"""Form of "module:class", names with dots between, so that no path can be imported."""

HASHED = (
    "airframe.py",
    "commands.py",
    "companion",
    "cpu_dispatch.py",
    "distortion.py",
    "engine.py",
    "execution",
    "external",
    "fiducial.py",
    "files",
    "flight",
    "foreign_text.py",
    "landing_system.py",
    "npcs",
    "process_tree.py",
    "program.py",
    "program_process.py",
    "scenarios",
    "search",
    "simulation",
    "vehicle",
    "verdicts",
)
"""Folders and modules of this package that shape a search: its hash covers them."""
HASHED_SUFFIXES = (".hpp", ".npz", ".obj", ".py", ".toml")
"""Files of weights, of meshes, of sources and of maps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """The module and the file that define a class or function."""

    module: str
    file: str
    qualname: str

    @property
    def name(self) -> str:
        """The name in ledgers, cases and baselines: "module:qualname"."""
        return f"{self.module}:{self.qualname}"

    def load(self) -> Any:
        """Return the object, imported by name or else from its file; raise what that raises."""
        try:
            module = importlib.import_module(self.module)
            if self.file and Path(module.__file__ or "").resolve() != Path(self.file):
                raise ImportError(f"{self.module} is another file: {module.__file__}")
        except ImportError:
            spec = importlib.util.spec_from_file_location(self.module, self.file)
            if spec is None or spec.loader is None:
                raise
            module = importlib.util.module_from_spec(spec)
            sys.modules[self.module] = module
            spec.loader.exec_module(module)
        program = program_named(self.module, self.qualname)
        return program or operator.attrgetter(self.qualname)(module)


BUILT_IN = Reference(module="pytest_garl.simulation.fly", file="", qualname="fly")
"""The project's own simulator."""


def reference_to(definition: Any) -> Reference:
    """Return the reference of a class, a function or a program.

    Raises LandingSystemError if no worker can import it.
    """
    if isinstance(definition, ProgramSystem):
        definition.check_place()
        return Reference(
            module=definition.__module__, file=definition.module_file, qualname=definition.name
        )
    qualname = getattr(definition, "__qualname__", "")
    if not qualname or "<locals>" in qualname or "<lambda>" in qualname:
        raise LandingSystemError(
            f"{definition!r} is defined inside a function; worker processes cannot import it. "
            "Move it to the top level of a module."
        )
    try:
        file = str(Path(inspect.getfile(definition)).resolve())
    except (TypeError, OSError):
        file = ""
    return Reference(module=definition.__module__, file=file, qualname=qualname)


@functools.cache
def package_sha256() -> str:
    """Return the hash of the parts of this package that shape a search.

    These are sources, maps, meshes and weights.
    """
    home = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in (home / name for name in HASHED):
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.suffix in HASHED_SUFFIXES:
                digest.update(file.relative_to(home).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()


def simulator_sha256(simulator: Reference) -> str:
    """Return the hash of the code that flies and judges a case, except the landing system.

    A simulator of the project's own is part of it, and so is the physics engine.
    """
    own = code_sha256(Path(simulator.file)) if simulator.file else ""
    # Cases that were saved when there was one engine only have this hash.
    engine = "" if chosen() == "bullet" else chosen()
    return hashlib.sha256(f"{flight_code_sha256()}{own}{engine}".encode()).hexdigest()


def system_named(name: str) -> Any:
    """Import a landing system by "module:class"; raise LandingSystemError if there is none."""
    if not SYSTEM_NAME.fullmatch(name):
        raise LandingSystemError(
            f"found {shown(name)}, expected 'module:class', names with dots between"
        )
    module, _, qualname = name.partition(":")
    try:
        loaded = importlib.import_module(module)
        found: Any = program_named(module, qualname) or operator.attrgetter(qualname)(loaded)
    except (Exception, SystemExit) as error:
        # A module may raise anything while it is imported.
        raise LandingSystemError(f"{type(error).__name__}: {error}") from error
    check_system(found)
    return found


def check_system(system: Any) -> None:
    """Raise LandingSystemError if a class or a program cannot be a landing system."""
    if isinstance(system, ProgramSystem):
        system.check_place()
        system.check()
        return
    if isinstance(system, str) and SYSTEM_NAME.fullmatch(system):
        module, _, name = system.partition(":")
        first = name.partition(".")[0]
        raise LandingSystemError(
            f"system={system!r}: expected a class, found its name; import it: "
            f"from {module} import {first}, and give system={name}"
        )
    if not inspect.isclass(system):
        raise LandingSystemError(
            f"system={system!r}: expected a class or a program, found {type(system).__name__}"
        )
    for method in ("reset", "step"):
        if not callable(getattr(system, method, None)):
            raise LandingSystemError(
                f"system={system.__name__} has no method {method!r}; a landing system has "
                "reset(mission) and step(observation), and `garl init --adapter MODULE:CLASS` "
                "writes one around a class of another interface"
            )
    reference = reference_to(system)
    known = sys.modules.get(reference.module)
    try:
        operator.attrgetter(reference.qualname)(known)
    except AttributeError as error:
        if known is not None:
            raise LandingSystemError(
                f"system={reference.qualname}: the module {reference.module} has no class of this "
                "name, by which worker processes import it; give the class the name that it has "
                "in its module"
            ) from error
