"""Find the statement of a test that failed, and the attributes of the landing that it read."""

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

from pytest_garl.cases.user_failure import UserFailure
from pytest_garl.messages import printable

FAILED_ASSERTION_TYPES: tuple[type[BaseException], ...] = (AssertionError, pytest.fail.Exception)
"""Exceptions by which a test says that a property does not hold; all others are errors."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AttributeRead:
    """One attribute of a landing that a test read; ``line`` is 0 outside of the test's body."""

    name: str
    line: int


def code_of(function: Callable[..., Any]) -> CodeType | None:
    """Return the code of a test function's body, or None if the test is no plain function."""
    plain = inspect.unwrap(function)
    code: CodeType | None = getattr(getattr(plain, "__func__", plain), "__code__", None)
    return code


def failure_of(
    test: str, function: Callable[..., Any], error: BaseException, reads: Sequence[AttributeRead]
) -> UserFailure | None:
    """Return which assertion of a test failed, or None if the error is no failed assertion."""
    if not isinstance(error, FAILED_ASSERTION_TYPES) or isinstance(error, pytest.xfail.Exception):
        return None
    path, line = _location(error, code_of(function))
    statement = _statement(path, line)
    return UserFailure(
        test=test,
        assertion=hashlib.sha256(statement.source.encode()).hexdigest()[:8],
        message=printable(str(error).partition("\n")[0] or statement.source.partition("\n")[0]),
        attributes=_attributes_of(statement, reads),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Statement:
    """A statement of a test.

    ``source`` has normal layout and no assertion message; ``only_in_message`` are the attributes
    that only the message reads.
    """

    source: str
    lines: range
    only_in_message: frozenset[str] = frozenset()


def _location(error: BaseException, code: CodeType | None) -> tuple[str, int]:
    """Return the file and line in the test's body where the error occurred, or the nearest ones."""
    places = []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code is code:
            return code.co_filename, trace.tb_lineno
        places.append((trace.tb_frame.f_code.co_filename, trace.tb_lineno))
        trace = trace.tb_next
    own_file = code.co_filename if code else ""
    unknown: tuple[str, int] = ("", 0)
    return next((place for place in places if place[0] == own_file), (*places, unknown)[0])


@functools.lru_cache(maxsize=1000)
def _statement(path: str, line: int) -> _Statement:
    """Return the innermost statement at a line; of a compound statement only its header."""
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
        only_in_message = _attributes(node.msg) - _attributes(node.test)
        # The message is no part of the property.
        node.msg = None
        return _Statement(source=ast.unparse(node), lines=lines, only_in_message=only_in_message)
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        if hasattr(node, name):
            setattr(node, name, [])
    return _Statement(source=ast.unparse(node), lines=lines)


def _attributes(node: ast.expr | None) -> frozenset[str]:
    inside = ast.walk(node) if node else ()
    return frozenset(each.attr for each in inside if isinstance(each, ast.Attribute))


def _attributes_of(statement: _Statement, reads: Sequence[AttributeRead]) -> frozenset[str]:
    """Return the attributes that a statement read, or those that the last line before it read."""

    def read_at(lines: Collection[int]) -> frozenset[str]:
        return frozenset(each.name for each in reads if each.line in lines)

    last_line = next((each.line for each in reversed(reads) if each.line), 0)
    return read_at(statement.lines) - statement.only_in_message or read_at({last_line})
