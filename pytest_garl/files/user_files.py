"""Strict reading of files that users write, and quoting for the writers of TOML.

A file is of a bounded size and read whole: no device, no pipe, and nothing that fills the memory.
Every error names the file, in TOML also the key, and what was expected.
"""

from __future__ import annotations

import math
import os
import re
import stat
import tomllib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from pytest_garl.errors import GarlError, ScenarioError
from pytest_garl.messages import listed, printable, shortened, shown

MEGABYTE = 1_000_000
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
LARGEST_INTEGER = 2**63 - 1
"""The largest integer that every TOML parser must accept."""
_MOST_KEY_PARTS = 32
_KEY_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w.-])(?:{_KEY_PART}[ \t]*+\.[ \t]*+){{{_MOST_KEY_PARTS}}}")
"""Matches a key with too many parts: the parser's time grows with the square of their number."""


def read_bytes(
    path: Path, limit: int = MEGABYTE, error: type[GarlError] = ScenarioError, hint: str = ""
) -> bytes:
    """Return what is in a regular file of at most ``limit`` bytes; raise ``error`` otherwise.

    ``hint`` says at the end of a message what file was expected.
    """
    try:
        found = path.stat()
        _check(path, found, limit, error, hint)
        # Without waiting, should a pipe take the file's place: it has no end.
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            _check(path, os.fstat(file.fileno()), limit, error, hint)
            content = file.read(limit + 1)
    except (OSError, ValueError) as problem:
        # A name with a null byte is a ValueError.
        reason = getattr(problem, "strerror", None) or problem
        raise error(f"{path}: cannot be read: {reason}{hint}") from problem
    if len(content) > limit:
        # Some files of the system say that they are empty, and grow while they are read.
        raise error(f"{path}: found more than {limit} bytes, expected at most {limit}{hint}")
    return content


def read_text(
    path: Path, limit: int = MEGABYTE, error: type[GarlError] = ScenarioError, hint: str = ""
) -> str:
    """Return the UTF-8 text in a regular file of at most ``limit`` bytes, as it is.

    Raises ``error`` as :func:`read_bytes` does, and if it is not UTF-8.
    """
    try:
        return read_bytes(path, limit, error, hint).decode()
    except UnicodeDecodeError as problem:
        raise error(f"{path}: cannot be read: {problem}{hint}") from problem


def _check(
    path: Path, found: os.stat_result, limit: int, error: type[GarlError], hint: str
) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = next((name for test, name in _KINDS if test(found.st_mode)), "something else")
        raise error(f"{path}: cannot be read: found {kind}, expected a regular file{hint}")
    if found.st_size > limit:
        raise error(f"{path}: found {found.st_size} bytes, expected at most {limit}{hint}")


def parse(text: str, source: str) -> dict[str, Any]:
    """Return the document; raise ScenarioError with the line for bad TOML."""
    if _LONG_KEY.search(text):
        raise ScenarioError(
            f"{source}: not valid TOML: found a name of more than {_MOST_KEY_PARTS} parts with "
            "dots between, expected fewer"
        )
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ScenarioError(
            f"{source}: not valid TOML: found lists or tables nested too deeply, expected a few "
            "levels"
        ) from error
    except ValueError as error:
        # Either an error of the parser, or an integer with more digits than Python converts.
        raise ScenarioError(f"{source}: not valid TOML: {shortened(str(error), 200)}") from error


def finite(value: object) -> float | None:
    """Return a finite number as float, or None for everything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


class Table:
    """One TOML table with its file and its path of keys.

    Methods that read raise ScenarioError that names both, for a missing key without default, for a
    value of another type, and for one beyond the limits given.
    """

    def __init__(self, values: Any, source: str, path: str = "") -> None:
        self.source, self.path = source, path
        if not isinstance(values, Mapping):
            raise self.error("", f"found {shown(values)}, expected a table")
        self.values: Mapping[str, Any] = values

    def error(self, key: str, problem: str) -> ScenarioError:
        """Return an error about a key of this table."""
        where = ".".join(part for part in (self.path, key) if part)
        return ScenarioError(f"{printable(self.source, keep='')}: key {shown(where)}: {problem}")

    def refuse_unknown(self, known: Collection[str]) -> None:
        """Raise an error for a key that is not in ``known``."""
        for key in self.values:
            if key not in known:
                raise self.error(key, f"unknown key; expected one of {listed(sorted(known))}")

    def get(self, key: str, default: Any = None) -> Any:
        """Return a value, or ``default`` if the key is missing; without one raise an error."""
        if key in self.values:
            return self.values[key]
        if default is None:
            raise self.error(key, "missing")
        return default

    def string(self, key: str, default: str | None = None, allowed: Collection[str] = ()) -> str:
        """Return a string, one of ``allowed`` if given; control characters are escaped."""
        value = self.get(key, default)
        if not isinstance(value, str):
            raise self.error(key, f"found {shown(value)}, expected a string")
        if allowed and value not in allowed:
            raise self.error(
                key, f"found {shown(value)}, expected one of {listed(sorted(allowed))}"
            )
        return printable(value)

    def strings(self, key: str) -> tuple[str, ...]:
        """Return a list of strings, empty if absent."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.error(key, f"found {shown(value)}, expected a list of strings")
        return tuple(printable(item) for item in value)

    def boolean(self, key: str, *, default: bool) -> bool:
        """Return true or false."""
        value = self.get(key, default=default)
        if not isinstance(value, bool):
            raise self.error(key, f"found {shown(value)}, expected true or false")
        return value

    def integer(
        self, key: str, default: int | None = None, low: int = 0, high: int = LARGEST_INTEGER
    ) -> int:
        """Return a whole number within [low, high]."""
        value = self.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            bounds = f"of at least {low}" if high == LARGEST_INTEGER else f"from {low} to {high}"
            raise self.error(key, f"found {shown(value)}, expected a whole number {bounds}")
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

    def choice(self, key: str, names: Sequence[str]) -> float:
        """Return the place of a name among ``names``, from 0; the file may state the number."""
        value = self.get(key)
        number = names.index(value) if value in names else finite(value)
        if number is None or not 0 <= number < len(names):
            raise self.error(
                key,
                f"found {shown(value)}, expected one of {listed(names)}, "
                f"or a number from 0 to {len(names) - 1}",
            )
        return float(number)

    def numbers(
        self,
        key: str,
        count: int,
        default: tuple[float, ...] | None = None,
        high: float = math.inf,
    ) -> tuple[float, ...]:
        """Return exactly ``count`` finite numbers within [-high, high]."""
        return self._numbers(key, self.get(key, default), count, high)

    def points(self, key: str, low: int, most: int, high: float) -> tuple[tuple[float, float], ...]:
        """Return ``low`` to ``most`` pairs (x, y) of numbers within [-high, high]."""
        value = self.get(key)
        if not isinstance(value, list):
            raise self.error(key, f"found {shown(value)}, expected a list of [x, y] pairs")
        if not low <= len(value) <= most:
            count = f"{low} to {most}" if most > low else f"exactly {low}"
            raise self.error(key, f"found {len(value)} points, expected {count}, each [x, y]")
        pairs = [self._numbers(key, pair, 2, high) for pair in value]
        return tuple((x, y) for x, y in pairs)

    def colour(self, key: str, default: tuple[int, int, int] | None = None) -> tuple[int, int, int]:
        """Return an RGB colour of three whole numbers from 0 to 255."""
        value = self.get(key, default)
        good = (
            isinstance(value, list | tuple)
            and len(value) == 3
            and all(type(item) is int and 0 <= item <= 255 for item in value)
        )
        if not good:
            raise self.error(
                key, f"found {shown(value)}, expected three whole numbers from 0 to 255"
            )
        red, green, blue = value
        return red, green, blue

    def table(self, key: str) -> Table:
        """Return a sub-table."""
        return Table(self.get(key), self.source, ".".join(p for p in (self.path, key) if p))

    def tables(self, key: str, most: int = 10_000) -> tuple[Table, ...]:
        """Return an array of at most ``most`` tables, empty if absent."""
        value = self.values.get(key, [])
        if not isinstance(value, list):
            raise self.error(key, f"found {shown(value)}, expected an array of tables")
        if len(value) > most:
            raise self.error(key, f"found {len(value)} tables, expected at most {most}")
        prefix = f"{self.path}." if self.path else ""
        return tuple(
            Table(item, self.source, f"{prefix}{key}[{index}]") for index, item in enumerate(value)
        )

    def _numbers(self, key: str, value: Any, count: int, high: float) -> tuple[float, ...]:
        if not isinstance(value, list | tuple) or len(value) != count:
            raise self.error(key, f"found {shown(value)}, expected {count} numbers")
        return tuple(self._number(key, item, -high, high) for item in value)

    def _number(self, key: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, f"found {shown(value)}, expected a number")
        number = finite(value)
        if number is None or not low <= number <= high:
            raise self.error(
                key, f"found {shown(value)}, expected a number from {low:g} to {high:g}"
            )
        return number


def read_table(path: Path) -> Table:
    """Return a TOML file as its top table; errors name the path."""
    return parse_table(read_text(path), str(path))


def parse_table(text: str, source: str) -> Table:
    """Return the document as its top table; raise ScenarioError with the line for bad TOML."""
    values = parse(text, source)
    return Table(values, source)


def quoted(value: str) -> str:
    """Return a TOML basic string."""
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    plain = "".join(
        char if char >= " " and char != "\x7f" else f"\\u{ord(char):04x}" for char in escaped
    )
    return f'"{plain}"'
