"""The code that flies and judges a saved case, as one hash.

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
from collections.abc import Iterator
from pathlib import Path

from pytest_garl.execution.sources import imported_names

ROOTS = (
    "pytest_garl.simulation.fly",
    "pytest_garl.npcs.recorded",
    "pytest_garl.verdicts.judge",
)
"""What flies a case, what moves its objects, and what judges it."""
NOT_FLOWN = frozenset({"pytest_garl", "pytest_garl.errors", "pytest_garl.messages"})
"""Modules that they import, and that decide nothing: the version, texts, and types of errors."""
_DATA_ROOMS = ("simulation", "verdicts")
"""Folders whose other files are read in a flight, such as meshes; maps have a hash of their own."""
_HOME = Path(__file__).resolve().parents[1]
_FIELDS_WITHOUT_MEANING = frozenset({"ctx", "kind", "type_comment", "type_ignores"})


@functools.cache
def flight_code_sha256() -> str:
    """Return the hash of the code that flies and judges a case, and of the data that it reads."""
    digest = hashlib.sha256()
    for name, tree in sorted(_modules().items()):
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
    return frozenset(_modules())


def _modules() -> dict[str, ast.Module]:
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
