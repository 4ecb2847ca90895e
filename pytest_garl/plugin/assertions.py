"""Where a test's assertion failed, and what of the landing it had read: what it is about."""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import linecache
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType
from typing import Any

import pytest

from pytest_garl.messages import printable

FAILS: tuple[type[BaseException], ...] = (AssertionError, pytest.fail.Exception)
"""How a test says that a property does not hold; any other exception is a fault of the test."""

ABOUT: dict[str, frozenset[str]] = {
    "distance": frozenset({"distance_to_landing_m", "final_distance_m"}),
    "time": frozenset({"time_to_landing_s", "elapsed_s"}),
    "collision": frozenset({"collisions"}),
}
"""What a test reads of a landing that asserts one of the built-in properties."""
ALL = frozenset({"outcome", "verdict", "result"})
"""What speaks of every built-in property."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Read:
    """One attribute of a landing that was read; ``line`` is the test's, 0 outside of its body."""

    name: str
    line: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A failed assertion of a test.

    ``digest`` is the hash of the statement in the test's own body, whoever raised below it;
    ``read`` is what of the landing that statement reads.
    """

    test: str
    digest: str
    message: str
    read: frozenset[str]

    @property
    def signature(self) -> str:
        """Signature of a property of the user's own."""
        return f"own:{self.test}:{self.digest}"

    def is_about(self, name: str | None) -> bool:
        """Whether the assertion is about a built-in property."""
        return name is not None and bool(self.read & (ALL | ABOUT.get(name, frozenset({name}))))


def code_of(function: Callable[..., Any]) -> CodeType | None:
    """Return the code of a test's own body, or None for what is no plain function."""
    plain = inspect.unwrap(function)
    code: CodeType | None = getattr(getattr(plain, "__func__", plain), "__code__", None)
    return code


def failure_of(
    test: str, function: Callable[..., Any], error: BaseException, reads: Sequence[Read]
) -> Failure | None:
    """Return which assertion of a test failed, or None for what is no assertion."""
    if not isinstance(error, FAILS) or isinstance(error, pytest.xfail.Exception):
        return None
    path, line = _place(error, code_of(function))
    statement = _statement(path, line)
    return Failure(
        test=test,
        digest=hashlib.sha256(statement.source.encode()).hexdigest()[:8],
        message=printable(str(error).partition("\n")[0] or statement.source.partition("\n")[0]),
        read=_read_by(statement, reads),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Statement:
    """A statement: its source, free of layout and message, its lines, what its message reads."""

    source: str
    lines: range
    message: frozenset[str] = frozenset()


def _place(error: BaseException, code: CodeType | None) -> tuple[str, int]:
    """Return file and line of the test's own body, or the nearest to it that the error passed."""
    places = []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code is code:
            return code.co_filename, trace.tb_lineno
        places.append((trace.tb_frame.f_code.co_filename, trace.tb_lineno))
        trace = trace.tb_next
    home = code.co_filename if code else ""
    nearest: tuple[str, int] = ("", 0)
    return next((place for place in places if place[0] == home), (*places, nearest)[0])


@functools.lru_cache(maxsize=1000)
def _statement(path: str, line: int) -> _Statement:
    """Return the innermost statement at a line; of one that holds others, its head alone."""
    try:
        tree = ast.parse("".join(linecache.getlines(path)))
    except SyntaxError:
        tree = ast.Module(body=[], type_ignores=[])
    found = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or 0)
    ]
    if not found:
        return _Statement(source=f"{Path(path).name}:{line}", lines=range(line, line + 1))
    node = max(found, key=lambda each: (each.lineno, -(each.end_lineno or 0), each.col_offset))
    inner: Sequence[ast.stmt] = getattr(node, "body", ())
    end = inner[0].lineno - 1 if inner else node.end_lineno or line
    lines = range(node.lineno, max(end, node.lineno) + 1)
    if isinstance(node, ast.Assert):
        message = _attributes(node.msg) - _attributes(node.test)
        # What it says of the failure is no part of the property.
        node.msg = None
        return _Statement(source=ast.unparse(node), lines=lines, message=message)
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        if hasattr(node, name):
            setattr(node, name, [])
    return _Statement(source=ast.unparse(node), lines=lines)


def _attributes(node: ast.expr | None) -> frozenset[str]:
    inside = ast.walk(node) if node else ()
    return frozenset(each.attr for each in inside if isinstance(each, ast.Attribute))


def _read_by(statement: _Statement, reads: Sequence[Read]) -> frozenset[str]:
    """Return what a statement has read, or the last before it that read anything."""

    def names(lines: Collection[int]) -> frozenset[str]:
        return frozenset(each.name for each in reads if each.line in lines)

    last = next((each.line for each in reversed(reads) if each.line), 0)
    return names(statement.lines) - statement.message or names({last})
