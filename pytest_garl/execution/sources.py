"""Hashes of sources: of a landing system, and of the code that flies and judges a saved case.

A landing system's sources are the project's modules that it imports, and its data files.  Imports
are read from the source code, not from the loaded modules.  So an import inside a function counts
before it runs, and imports of other code do not count.  A module whose name is only known at run
time is not found; the ``files`` argument of ``pytest.mark.garl`` can name it.

A pass proves that a landing system was repaired only if nothing else has changed that decides
whether it passes: the simulator, what moves the objects of a case, and the verdict.  These are the
modules that :data:`ROOTS` import, wherever they import them.  Parsed code is hashed, so that
comments, docstrings and layout do not matter.  The search, the processes that fly, the learned
policies and the reports are not among them.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from pytest_garl.errors import LandingSystemError
from pytest_garl.program import ProgramSystem

_HOME = Path(__file__).resolve().parents[1]
"""The folder of pytest_garl."""
ROOTS = (
    "pytest_garl.simulation.fly",
    "pytest_garl.npcs.recorded",
    "pytest_garl.verdicts.judge",
)
"""What flies a case, what moves its objects, and what judges it."""
NOT_FLOWN = frozenset({"pytest_garl", "pytest_garl.errors", "pytest_garl.messages"})
"""Modules that they import, and that decide nothing: the version, texts, and types of errors."""
_STACK_ROOMS = ("companion", "external", "program.py", "vehicle")
"""What ships here and is part of the landing system that uses it."""
_DATA_ROOMS = ("simulation", "verdicts")
"""Folders whose other files are read in a flight, such as meshes; maps have a hash of their own."""
_FIELDS_WITHOUT_MEANING = frozenset({"ctx", "kind", "type_comment", "type_ignores"})


def sources_sha256(system: Any, files: Mapping[str, Path] | None = None) -> str:
    """Return one hash of the project's modules that a landing system imports, and of data files."""
    return combined_sha256(source_hashes(system, files))


def combined_sha256(sources: Iterable[tuple[str, str]]) -> str:
    """Return one hash of many names and hashes."""
    digest = hashlib.sha256()
    for name, sha256 in sources:
        digest.update(f"{name}\0{sha256}\n".encode())
    return digest.hexdigest()


def source_hashes(
    definition: Any, files: Mapping[str, Path] | None = None
) -> tuple[tuple[str, str], ...]:
    """Return the sources of a class, a function or a program: names of files with their hashes.

    The name of a module's file is relative to the folder from which it is imported.
    """
    found = {module.source_name: module.file for module in _modules(definition)}
    found.update(files or {})
    hashes = {name: _sha256(file) for name, file in found.items()}
    if isinstance(definition, ProgramSystem):
        hashes.update(definition.source_hashes())
        # Its room holds code too that only the program's own process imports.
        room = Path(inspect.getfile(type(definition))).resolve().parent
        if room.is_relative_to(_HOME):
            hashes |= {_name(file, _HOME.parent): _sha256(file) for file in room.rglob("*.py")}
    return tuple(sorted(hashes.items()))


def data_files(paths: Sequence[str], root: Path) -> dict[str, Path]:
    """Return the files at paths below ``root`` by their names; a folder means all files in it.

    Raises LandingSystemError if there is no such path: the mark of a test names them.
    """
    found: dict[str, Path] = {}
    for path in paths:
        target = root / path
        if not target.exists():
            raise LandingSystemError(
                f"mark.garl: files: there is no {path!r} below {root}; expected a file or a folder"
            )
        inside = sorted(target.rglob("*")) if target.is_dir() else [target]
        found.update((_name(file, root), file) for file in inside if file.is_file())
    return found


def _name(file: Path, root: Path) -> str:
    return file.relative_to(root).as_posix() if file.is_relative_to(root) else str(file)


def _sha256(file: Path) -> str:
    stat = file.stat()
    return _cached_sha256(file, stat.st_mtime_ns, stat.st_size, stat.st_ino)


@functools.lru_cache(maxsize=4096)
def _cached_sha256(file: Path, *_: int) -> str:
    # The other arguments only belong to the key of the cache: they change with the file.
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Module:
    name: str
    file: Path
    is_package: bool

    @property
    def source_name(self) -> str:
        """The file's path from the folder in which imports find the module."""
        path = self.name.replace(".", "/")
        return f"{path}/{self.file.name}" if self.is_package else f"{path}{self.file.suffix}"

    def imports(self) -> frozenset[str]:
        """Return the names that it imports, of modules or of objects in modules."""
        if self.file.suffix != ".py":
            return frozenset()
        base = self.name if self.is_package else self.name.rpartition(".")[0]
        return _imports(self.file.read_bytes(), base)


def _modules(definition: Any) -> list[_Module]:
    """Return the module that defines ``definition``, and the project's modules that it imports."""
    start = _defining(definition)
    found = {start.name: start} if start else {}
    unvisited = list(found.values())
    while unvisited:
        module = unvisited.pop()
        # A package is imported before its modules.
        for name in {*module.imports(), *_parents(module.name)}:
            imported = None if name in found else _find(name)
            if imported is not None and _belongs_to_project(imported.file):
                found[name] = imported
                unvisited.append(imported)
    return [found[name] for name in sorted(found)]


def _defining(definition: Any) -> _Module | None:
    """Return the module of a class or function, however it was loaded.

    Of a program it is that of its own class, since the tests beside it are no part of it.
    """
    if isinstance(definition, ProgramSystem):
        definition = type(definition)
    try:
        file = Path(inspect.getfile(definition)).resolve()
    except (TypeError, OSError):
        return None
    is_package = file.name == "__init__.py"
    return _Module(name=definition.__module__, file=file, is_package=is_package)


@functools.lru_cache(maxsize=1024)
def _imports(source: bytes, package: str) -> frozenset[str]:
    """Return the names that source code imports; none if it cannot be parsed."""
    try:
        return imported_names(ast.parse(source), package)
    except (SyntaxError, ValueError):
        return frozenset()


def imported_names(tree: ast.Module, package: str) -> frozenset[str]:
    """Return the names that a module imports, at its top level or in a function.

    ``package`` is the package that relative imports start from.
    """
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            # One leading dot is the package itself, each further dot the package above.
            above = package.split(".")[: len(package.split(".")) - node.level + 1]
            parts = [*(above if node.level else ()), *filter(None, [node.module])]
            base = ".".join(parts)
            found.update(f"{base}.{alias.name}" for alias in node.names)
            found.add(base)
    return frozenset(found | {parent for name in found for parent in _parents(name)})


def _parents(name: str) -> Iterator[str]:
    """Yield the packages of a module, the innermost first."""
    while "." in name:
        name = name.rpartition(".")[0]
        yield name


def module_file(name: str, folder: Path) -> Path | None:
    """Return the file of a module that Python, or ``folder``, has; None if there is none.

    Nothing is imported.
    """
    found = _find(name)
    if found is not None:
        return found.file
    places: Sequence[str] | None = [str(folder)]
    spec = None
    for part in (*reversed([*_parents(name)]), name):
        spec = PathFinder.find_spec(part, places) if places else None
        places = spec.submodule_search_locations if spec else None
    return Path(spec.origin) if spec and spec.origin and Path(spec.origin).is_file() else None


def _find(name: str) -> _Module | None:
    """Return a module without importing it; None if it has no file."""
    if not name or name.partition(".")[0] in sys.stdlib_module_names:
        return None
    loaded = sys.modules.get(name)
    spec = getattr(loaded, "__spec__", None) or _spec(name)
    if spec is None:
        return None
    # A package without __init__.py has no file of its own.
    file = Path(spec.origin) if spec.origin else None
    if file is None or not file.is_file():
        return None
    is_package = bool(spec.submodule_search_locations)
    return _Module(name=name, file=file.resolve(), is_package=is_package)


def _spec(name: str) -> Any:
    """Return the import specification of a module that is not loaded, or None."""
    parent = name.rpartition(".")[0]
    folders = None
    if parent:
        parent_spec = getattr(sys.modules.get(parent), "__spec__", None) or _spec(parent)
        folders = getattr(parent_spec, "submodule_search_locations", None)
        if folders is None:
            return None
    for finder in sys.meta_path:
        find = getattr(finder, "find_spec", None)
        spec = find(name, folders, None) if find else None
        if spec is not None:
            return spec
    return None


def _belongs_to_project(file: Path) -> bool:
    """Whether a file is part of a landing stack: not Python's and not installed.

    Of pytest_garl these are the vehicles, and what carries a program.
    """
    if any(file.is_relative_to(_HOME / room) for room in _STACK_ROOMS):
        return True
    installed = {"site-packages", "dist-packages"}
    return not installed & {*file.parts} and not any(
        file.is_relative_to(folder) for folder in _folders_outside_project()
    )


@functools.cache
def _folders_outside_project() -> tuple[Path, ...]:
    paths = sysconfig.get_paths()
    folders = [paths[key] for key in ("stdlib", "platstdlib", "purelib", "platlib")]
    folders += [*site.getsitepackages(), site.getusersitepackages()]
    return (_HOME, *(Path(folder).resolve() for folder in folders))


@functools.cache
def flight_code_sha256() -> str:
    """Return the hash of the code that flies and judges a case, and of the data that it reads."""
    digest = hashlib.sha256()
    for name, tree in sorted(_flown().items()):
        digest.update(f"{name}\0{_meaning(tree)}\n".encode())
    for file in _data_files():
        digest.update(file.relative_to(_HOME).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()


def code_sha256(file: Path) -> str:
    """Return the hash of the parsed code in a file; of its bytes if Python cannot parse it."""
    stat = file.stat()
    return _code_sha256(file, stat.st_mtime_ns, stat.st_size)


@functools.cache
def _code_sha256(file: Path, changed_ns: int, size: int) -> str:
    """Parse a state of a file once: CPython 3.11 cannot parse in two threads at a time."""
    del changed_ns, size
    source = file.read_bytes()
    try:
        return hashlib.sha256(_meaning(ast.parse(source)).encode()).hexdigest()
    except (SyntaxError, ValueError):
        return hashlib.sha256(source).hexdigest()


def flown_modules() -> frozenset[str]:
    """Return the names of the modules that fly and judge a case."""
    return frozenset(_flown())


def _flown() -> dict[str, ast.Module]:
    """Return the parsed modules by name; a parsed module takes too much room to be kept."""
    found: dict[str, ast.Module] = {}
    seen = {*NOT_FLOWN}
    unvisited = list(ROOTS)
    while unvisited:
        name = unvisited.pop()
        file = None if name in seen else _file(name)
        seen.add(name)
        if file is None:
            continue
        found[name] = tree = ast.parse(file.read_bytes())
        package = name if file.name == "__init__.py" else name.rpartition(".")[0]
        unvisited += imported_names(tree, package)
    return found


def _file(name: str) -> Path | None:
    """Return the file of a module of this package; None for an object, or another package."""
    first, *parts = name.split(".")
    if first != _HOME.name:
        return None
    place = _HOME.joinpath(*parts)
    files = (place / "__init__.py", place.with_suffix(".py"))
    return next((file for file in files if file.is_file()), None)


def _data_files() -> Iterator[Path]:
    for room in _DATA_ROOMS:
        for file in sorted((_HOME / room).rglob("*")):
            if file.is_file() and "__pycache__" not in file.parts and file.suffix != ".py":
                yield file


def _meaning(tree: ast.AST) -> str:
    """Return a text that is equal for equal code, in every version of Python."""
    parts: list[str] = []
    _write(tree, parts)
    return "".join(parts)


def _write(node: object, parts: list[str]) -> None:
    if isinstance(node, ast.AST):
        parts.append(f"({type(node).__name__}")
        for field in node._fields:
            value = getattr(node, field, None)
            # Later versions of Python have more fields, which are empty for this code.
            if value is None or value == [] or field in _FIELDS_WITHOUT_MEANING:
                continue
            parts.append(f" {field}=")
            _write(value, parts)
        parts.append(")")
    elif isinstance(node, list):
        for each in node:
            if not _is_text(each):
                _write(each, parts)
                parts.append(",")
    else:
        parts.append(repr(node))


def _is_text(node: object) -> bool:
    """Return whether a statement is a text, as a docstring is."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )
