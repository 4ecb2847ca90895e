"""Reads values that a landing system made: plain and finite, or an error that names the field."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from pytest_garl.foreign_text import shown_foreign

Vector = tuple[float, float, float]


class NonsenseError(Exception):
    """A value that breaks the contract; ``error`` is the kind of it in a signature."""

    def __init__(self, message: str, error: str = "BadCommand") -> None:
        super().__init__(message)
        self.error = error


def number(
    value: object, field: str, low: float = -math.inf, high: float = math.inf, unit: str = ""
) -> float:
    """Return a finite Python float from ``low`` to ``high``, or raise NonsenseError."""
    found = finite(value)
    if found is None:
        raise NonsenseError(f"{field} = {shown_foreign(value)}; expected a finite number")
    if not low <= found <= high:
        raise NonsenseError(
            f"{field} = {shown_foreign(value)}; expected {low:g} to {high:g} {unit}".rstrip()
        )
    return found


def numbers(
    value: object, field: str, count: int, most: float = math.inf, unit: str = ""
) -> tuple[float, ...]:
    """Return ``count`` finite Python floats of any sequence, none beyond ``most`` or ``-most``.

    Raises NonsenseError for anything else.
    """
    found = [finite(item) for item in items(value, count) or ()]
    if len(found) != count or None in found:
        raise NonsenseError(f"{field} = {shown_foreign(value)}; expected {count} finite numbers")
    plain = tuple(item for item in found if item is not None)
    if any(abs(item) > most for item in plain):
        expected = f"expected each from {-most:g} to {most:g} {unit}".rstrip()
        raise NonsenseError(f"{field} = {shown_foreign(plain)}; {expected}")
    return plain


def are_floats(value: object, count: int) -> bool:
    """Whether a value is a tuple of ``count`` finite floats: a fast test of the usual case."""
    return (
        type(value) is tuple
        and len(value) == count
        and all(type(item) is float for item in value)
        and math.isfinite(math.hypot(*value))
    )


def vector(value: object, field: str, most: float = math.inf, unit: str = "") -> Vector:
    """Return three finite Python floats, none beyond ``most``."""
    x, y, z = numbers(value, field, 3, most, unit)
    return x, y, z


def items(value: object, most: int) -> list[Any] | None:
    """Return at most ``most + 1`` items of an iterable; None for other values.

    The value is read once, so it may be a generator, even an endless one.
    """
    if isinstance(value, str | bytes | dict | set | frozenset):
        return None
    try:
        each = iter(value)  # type: ignore[call-overload]  # that is the question
    except TypeError:
        return None
    return list(itertools.islice(each, most + 1))


def finite(value: object) -> float | None:
    """Return a value as a finite Python float, or None."""
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, str | bytes | bytearray | complex | np.complexfloating):
        return None
    if isinstance(value, np.ndarray) and value.ndim:
        return None
    try:
        # A subclass of float may come back; its plain value is what counts.
        found = float.__float__(float(value))  # type: ignore[arg-type]  # that is the question
    except (TypeError, ValueError, OverflowError):
        return None
    return found if math.isfinite(found) else None
