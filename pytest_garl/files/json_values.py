"""Conversion of plain JSON values to dataclasses; each field is checked: files may be damaged."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import json
import sys
import types
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

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
    if not isinstance(value, dict):
        raise _wrong(where, value, "a table")
    hints = _hints(kind)  # type: ignore[arg-type]  # a class can be hashed
    if value.keys() != hints.keys():
        wrong = listed(sorted(value.keys() ^ hints.keys()))
        raise ValueError(f"{where or 'the value'}: found other keys than expected: {wrong}")
    prefix = f"{where}." if where else ""
    return kind(**{name: _value(hints[name], value[name], prefix + name) for name in hints})


@functools.cache
def _hints(kind: type) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


def _value(kind: Any, value: Any, where: str) -> Any:
    origin = get_origin(kind)
    if kind is float:
        return _float(value, where)
    if kind in (int, str, bool, type(None)):
        if type(value) is not kind:
            raise _wrong(where, value, _EXPECTED[kind])
        return value
    if origin is Literal:
        if not isinstance(value, str) or value not in get_args(kind):
            raise _wrong(where, value, f"one of {', '.join(map(repr, get_args(kind)))}")
        return value
    if origin in (Union, types.UnionType):
        return _one_of(get_args(kind), value, where)
    if origin is tuple:
        return _tuple(get_args(kind), value, where)
    if origin is dict:
        if not isinstance(value, dict):
            raise _wrong(where, value, "a table")
        return value
    return dataclass_from(kind, value, where)


def _one_of(kinds: tuple[Any, ...], value: Any, where: str) -> Any:
    if value is None and type(None) in kinds:
        return None
    *others, last = (kind for kind in kinds if kind is not type(None))
    for kind in others:
        with contextlib.suppress(ValueError):
            return _value(kind, value, where)
    return _value(last, value, where)


_EXPECTED = {int: "a whole number", str: "a text", bool: "true or false", type(None): "null"}


def _float(value: Any, where: str) -> float:
    if type(value) not in (int, float) or not abs(value) <= sys.float_info.max:
        raise _wrong(where, value, "a finite number")
    # Not converted to float: 1 and 1.0 are written differently, which would change hashes.
    number: float = value
    return number


def _tuple(kinds: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise _wrong(where, value, "a list")
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(value) != len(kinds):
        raise _wrong(where, value, f"a list of {len(kinds)}")
    return tuple(
        _value(kind, item, f"{where}[{index}]")
        for index, (kind, item) in enumerate(zip(kinds, value, strict=True))
    )


def _wrong(where: str, value: Any, expected: str) -> ValueError:
    return ValueError(f"{where or 'the value'}: found {shown(value)}, expected {expected}")
