"""The sources of a landing system: the project's modules that it imports, and its data files.

Imports are read from the source code, not from the loaded modules.  So an import inside a function
counts before it runs, and imports of other code do not count.  A module whose name is only known at
run time is not found; the marker's ``files`` can name it.
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
from pathlib import Path
from typing import Any

_HERE = Path(__file__).resolve().parents[1]


def sources_sha256(system: Any, files: Mapping[str, Path] | None = None) -> str:
    """Hash the project's modules that a landing system imports, and data files."""
    return combined_sha256(source_hashes(system, files))


def combined_sha256(sources: Iterable[tuple[str, str]]) -> str:
    """Return one hash of many names and hashes."""
    digest = hashlib.sha256()
    for name, sha256 in sources:
        digest.update(f"{name}\0{sha256}\n".encode())
    return digest.hexdigest()


def source_hashes(
    thing: Any, files: Mapping[str, Path] | None = None
) -> tuple[tuple[str, str], ...]:
    """Return the sources of a class or function: names of files with their hashes.

    The name of a module's file is relative to the folder from which it is imported.
    """
    found = {module.label: module.file for module in _modules(thing)}
    found.update(files or {})
    return tuple(sorted((name, _sha256(file)) for name, file in found.items()))


def data_files(paths: Sequence[str], root: Path) -> dict[str, Path]:
    """Return the files at paths below ``root`` by name; a folder stands for all files in it.

    Raises FileNotFoundError, with the path as its message, if there is no such path.
    """
    found: dict[str, Path] = {}
    for path in paths:
        place = root / path
        if not place.exists():
            raise FileNotFoundError(path)
        inside = sorted(place.rglob("*")) if place.is_dir() else [place]
        found.update((_name(file, root), file) for file in inside if file.is_file())
    return found


def _name(file: Path, root: Path) -> str:
    return file.relative_to(root).as_posix() if file.is_relative_to(root) else str(file)


def _sha256(file: Path) -> str:
    about = file.stat()
    return _hashed(file, about.st_mtime_ns, about.st_size, about.st_ino)


@functools.lru_cache(maxsize=4096)
def _hashed(file: Path, *_: int) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Module:
    name: str
    file: Path
    places: tuple[str, ...]
    """Folders of the submodules if this is a package."""
    package: bool

    @property
    def label(self) -> str:
        path = self.name.replace(".", "/")
        return f"{path}/{self.file.name}" if self.package else f"{path}{self.file.suffix}"

    def imports(self) -> frozenset[str]:
        """Return the names that it imports, of modules or of objects in modules."""
        if self.file.suffix != ".py":
            return frozenset()
        base = self.name if self.package else self.name.rpartition(".")[0]
        return _imports(self.file.read_bytes(), base)


def _modules(thing: Any) -> list[_Module]:
    """Return the module that defines ``thing``, and the project's modules that it imports."""
    first = _defining(thing)
    found = {first.name: first} if first else {}
    left = list(found.values())
    while left:
        module = left.pop()
        # A package is imported before its modules.
        for name in {*module.imports(), *_parents(module.name)}:
            other = None if name in found else _find(name)
            if other is not None and _of_the_project(other.file):
                found[name] = other
                left.append(other)
    return [found[name] for name in sorted(found)]


def _defining(thing: Any) -> _Module | None:
    """Return the module of a class or function, however it was loaded."""
    try:
        file = Path(inspect.getfile(thing)).resolve()
    except (TypeError, OSError):
        return None
    package = file.name == "__init__.py"
    places = (str(file.parent),) if package else ()
    return _Module(name=thing.__module__, file=file, places=places, package=package)


@functools.lru_cache(maxsize=1024)
def _imports(source: bytes, package: str) -> frozenset[str]:
    """Return the names that a source imports, at its top level or in a function."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return frozenset()
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1]
            words = [*(above if node.level else ()), *filter(None, [node.module])]
            base = ".".join(words)
            found.update(f"{base}.{alias.name}" for alias in node.names)
            found.add(base)
    return frozenset(found | {above for name in found for above in _parents(name)})


def _parents(name: str) -> Iterator[str]:
    while "." in name:
        name = name.rpartition(".")[0]
        yield name


def _find(name: str) -> _Module | None:
    """Return a module without importing it; None if it has no file."""
    if not name or name.partition(".")[0] in sys.stdlib_module_names:
        return None
    loaded = sys.modules.get(name)
    spec = getattr(loaded, "__spec__", None) or _spec(name)
    if spec is None:
        return None
    places = tuple(spec.submodule_search_locations or ())
    # A package without __init__.py has no file of its own.
    file = Path(spec.origin) if spec.origin else None
    if file is None or not file.is_file():
        return None
    return _Module(name=name, file=file.resolve(), places=places, package=bool(places))


def _spec(name: str) -> Any:
    parent = name.rpartition(".")[0]
    places = None
    if parent:
        above = getattr(sys.modules.get(parent), "__spec__", None) or _spec(parent)
        places = getattr(above, "submodule_search_locations", None)
        if places is None:
            return None
    for finder in sys.meta_path:
        find = getattr(finder, "find_spec", None)
        spec = find(name, places, None) if find else None
        if spec is not None:
            return spec
    return None


def _of_the_project(file: Path) -> bool:
    """Whether a file is the user's own: not Python's, not installed, not of this package."""
    installed = {"site-packages", "dist-packages"}
    return not installed & {*file.parts} and not any(
        file.is_relative_to(folder) for folder in _not_of_the_project()
    )


@functools.cache
def _not_of_the_project() -> tuple[Path, ...]:
    paths = sysconfig.get_paths()
    folders = [paths[key] for key in ("stdlib", "platstdlib", "purelib", "platlib")]
    folders += [*site.getsitepackages(), site.getusersitepackages()]
    return (_HERE, *(Path(folder).resolve() for folder in folders))
