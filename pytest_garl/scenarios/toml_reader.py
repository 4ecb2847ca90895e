"""Strict reading of TOML: every error names the file, the key and what was expected."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Mapping
from typing import Any

from pytest_garl.errors import ScenarioError


def parse(text: str, source: str) -> dict[str, Any]:
    """Return the document; raise ScenarioError with the line for bad TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: not valid TOML: {error}") from error


class Table:
    """One table of a document that remembers where it stands, so that errors can say it."""

    def __init__(self, values: Any, source: str, path: str = "") -> None:
        self.source = source
        self.path = path
        if not isinstance(values, Mapping):
            raise self.error("", f"found {values!r}, expected a table")
        self.values: Mapping[str, Any] = values

    def error(self, key: str, problem: str) -> ScenarioError:
        """Return an error about a key of this table."""
        where = ".".join(part for part in (self.path, key) if part)
        return ScenarioError(f"{self.source}: key {where!r}: {problem}")

    def only(self, known: Collection[str]) -> None:
        """Refuse keys that nobody reads."""
        for key in self.values:
            if key not in known:
                raise self.error(key, f"unknown key; expected one of {', '.join(sorted(known))}")

    def get(self, key: str, default: Any = None) -> Any:
        """Return a value; without default a missing key is an error."""
        if key in self.values:
            return self.values[key]
        if default is None:
            raise self.error(key, "missing")
        return default

    def text(self, key: str, default: str | None = None, among: Collection[str] = ()) -> str:
        """Return a string, one of ``among`` if given."""
        value = self.get(key, default)
        if not isinstance(value, str):
            raise self.error(key, f"found {value!r}, expected a string")
        if among and value not in among:
            raise self.error(key, f"found {value!r}, expected one of {', '.join(sorted(among))}")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """Return a list of strings, empty if absent."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.error(key, f"found {value!r}, expected a list of strings")
        return tuple(value)

    def truth(self, key: str, *, default: bool) -> bool:
        """Return true or false."""
        value = self.get(key, default=default)
        if not isinstance(value, bool):
            raise self.error(key, f"found {value!r}, expected true or false")
        return value

    def integer(self, key: str, default: int | None = None, low: int = 0) -> int:
        """Return a whole number of at least ``low``."""
        value = self.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or value < low:
            raise self.error(key, f"found {value!r}, expected a whole number of at least {low}")
        return value

    def number(
        self,
        key: str,
        default: float | None = None,
        low: float = -math.inf,
        high: float = math.inf,
    ) -> float:
        """Return a finite number within [low, high]."""
        return self._number(key, self.get(key, default), low, high)

    def numbers(
        self, key: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        """Return exactly ``count`` finite numbers."""
        return self._numbers(key, self.get(key, default), count)

    def points(self, key: str) -> tuple[tuple[float, float], ...]:
        """Return a list of (x, y) pairs."""
        value = self.get(key)
        if not isinstance(value, list) or not value:
            raise self.error(key, f"found {value!r}, expected a list of [x, y] pairs")
        pairs = [self._numbers(key, pair, 2) for pair in value]
        return tuple((x, y) for x, y in pairs)

    def colour(self, key: str, default: tuple[int, int, int] | None = None) -> tuple[int, int, int]:
        """Return an RGB colour of three whole numbers from 0 to 255."""
        value = self.get(key, default)
        good = (
            isinstance(value, list | tuple)
            and len(value) == 3
            and all(isinstance(item, int) and 0 <= item <= 255 for item in value)
        )
        if not good:
            raise self.error(key, f"found {value!r}, expected three whole numbers from 0 to 255")
        red, green, blue = value
        return red, green, blue

    def table(self, key: str) -> Table:
        """Return a sub-table."""
        return Table(self.get(key), self.source, ".".join(p for p in (self.path, key) if p))

    def tables(self, key: str) -> tuple[Table, ...]:
        """Return an array of tables, empty if absent."""
        value = self.values.get(key, [])
        if not isinstance(value, list):
            raise self.error(key, f"found {value!r}, expected an array of tables")
        prefix = f"{self.path}." if self.path else ""
        return tuple(
            Table(item, self.source, f"{prefix}{key}[{index}]") for index, item in enumerate(value)
        )

    def _numbers(self, key: str, value: Any, count: int) -> tuple[float, ...]:
        if not isinstance(value, list | tuple) or len(value) != count:
            raise self.error(key, f"found {value!r}, expected {count} numbers")
        return tuple(self._number(key, item, -math.inf, math.inf) for item in value)

    def _number(self, key: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, f"found {value!r}, expected a number")
        if not math.isfinite(value) or not low <= value <= high:
            raise self.error(key, f"found {value!r}, expected a number from {low:g} to {high:g}")
        return float(value)
