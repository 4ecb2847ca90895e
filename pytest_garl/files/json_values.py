"""Conversion of plain JSON values to dataclasses; each field is checked: files may be damaged."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import json
import sys
import types
from collections.abc import Callable, Sequence
from typing import (
    Any,
    Literal,
    Self,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from pytest_garl.messages import listed, shortened, shown

T = TypeVar("T")


def parse_json(text: str | bytes) -> Any:
    """Return the value of a JSON text; raise ValueError with a short message if it is not valid."""
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("not valid JSON: nested too deeply") from error
    except (ValueError, TypeError) as error:
        raise ValueError(f"not valid JSON: {shortened(str(error))}") from error


def dataclass_from(kind: type[T], value: Any, where: str = "") -> T:
    """Return a dataclass from plain values, the inverse of ``dataclasses.asdict``.

    Lists become tuples.  Raises ValueError that names the field, what was found and what was
    expected, or that lists the missing and the unknown fields.
    """
    try:
        found: T = _reader(kind)(value)  # type: ignore[arg-type]  # a class can be hashed
    except _WrongValueError as error:
        place = (where + error.place).removeprefix(".") or "the value"
        raise ValueError(f"{place}: {error.text}") from None
    return found


class _WrongValueError(Exception):
    """What is wrong with a value; on its way up each reader puts its part before the place.

    So the place costs nothing while all values are right: a flight's record has 20,000.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.text, self.place = text, ""

    def within(self, part: str) -> Self:
        self.place = part + self.place
        return self


_Reader = Callable[[Any], Any]
"""Returns a checked value, or raises _WrongValueError."""


@functools.cache
def _reader(kind: Any) -> _Reader:
    """Return what reads values of a type; types are looked into once."""
    origin, kinds = get_origin(kind), get_args(kind)
    if kind is float:
        return _float
    if kind in _EXPECTED:
        return functools.partial(_plain, kind)
    if origin is Literal:
        return functools.partial(_literal, kinds)
    if origin in (Union, types.UnionType):
        readers = tuple(_reader(each) for each in kinds if each is not type(None))
        return functools.partial(_one_of, readers, len(readers) < len(kinds))
    if origin is tuple:
        if len(kinds) == 2 and kinds[1] is Ellipsis:
            return functools.partial(_sequence, _reader(kinds[0]))
        return functools.partial(_tuple, tuple(_reader(each) for each in kinds))
    if origin is dict:
        return _dict
    return _dataclass_reader(kind)


def _dataclass_reader(kind: Any) -> _Reader:
    hints = get_type_hints(kind)
    readers = {field.name: _reader(hints[field.name]) for field in dataclasses.fields(kind)}

    def read(value: Any) -> Any:
        if not isinstance(value, dict):
            raise _wrong(value, "a table")
        if value.keys() != readers.keys():
            wrong = listed(sorted(value.keys() ^ readers.keys()))
            raise _WrongValueError(f"found other keys than expected: {wrong}")
        found, name = {}, ""
        try:
            for name, reader in readers.items():
                found[name] = reader(value[name])
        except _WrongValueError as error:
            raise error.within(f".{name}") from None
        return kind(**found)

    return read


_EXPECTED = {int: "a whole number", str: "a text", bool: "true or false", type(None): "null"}


def _plain(kind: Any, value: Any) -> Any:
    if type(value) is not kind:
        raise _wrong(value, _EXPECTED[kind])
    return value


def _float(value: Any) -> float:
    if type(value) not in (int, float) or not abs(value) <= sys.float_info.max:
        raise _wrong(value, "a finite number")
    # Not converted to float: 1 and 1.0 are written differently, which would change hashes.
    number: float = value
    return number


def _literal(choices: tuple[str, ...], value: Any) -> Any:
    if not isinstance(value, str) or value not in choices:
        raise _wrong(value, f"one of {', '.join(map(repr, choices))}")
    return value


def _dict(value: Any) -> Any:
    if not isinstance(value, dict):
        raise _wrong(value, "a table")
    return value


def _one_of(readers: tuple[_Reader, ...], may_be_none: bool, value: Any) -> Any:
    if value is None and may_be_none:
        return None
    *others, last = readers
    for reader in others:
        with contextlib.suppress(_WrongValueError):
            return reader(value)
    return last(value)


def _sequence(reader: _Reader, value: Any) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise _wrong(value, "a list")
    return _items((reader,) * len(value), value)


def _tuple(readers: tuple[_Reader, ...], value: Any) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise _wrong(value, "a list")
    if len(value) != len(readers):
        raise _wrong(value, f"a list of {len(readers)}")
    return _items(readers, value)


def _items(readers: tuple[_Reader, ...], values: Sequence[Any]) -> tuple[Any, ...]:
    found: list[Any] = []
    try:
        for reader, value in zip(readers, values, strict=True):
            found.append(reader(value))
    except _WrongValueError as error:
        raise error.within(f"[{len(found)}]") from None
    return tuple(found)


def _wrong(value: Any, expected: str) -> _WrongValueError:
    return _WrongValueError(f"found {shown(value)}, expected {expected}")
