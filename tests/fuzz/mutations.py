"""Changes of good files as a broken disk, a bad merge or a hostile stranger makes them."""

from __future__ import annotations

import copy
import json
import random
import re
from typing import Any

RUDE_TOML = (
    "",
    "0",
    "-1",
    "1",
    "-0.0",
    "0.5",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "1e400",
    "-1e300",
    "1e-320",
    "9223372036854775807",
    "9223372036854775808",
    "9" * 400,
    "9" * 5000,
    "0x" + "f" * 5000,
    "true",
    "false",
    '""',
    '"x"',
    f'"{"x" * 100_000}"',
    '"\\u001b[2J\\u202e"',
    '"\\uffff"',
    '"\\n\\n"',
    '"../../../etc/passwd"',
    '"/dev/zero"',
    '"os:system"',
    "'''\n'''",
    "[]",
    "[[]]",
    "[[[[[]]]]]",
    "[nan, inf]",
    "[1, 2, 3]",
    '["a", "b"]',
    "[[10000, 0.0, 1.0]]",
    f"[{'1, ' * 50_000}]",
    f"[{'[600, 0.0, 0.0], ' * 2000}]",
    "[" * 3000,
    "[" * 900 + "]" * 900,
    "{}",
    "{ a = 1 }",
    "{ a = { b = { c = [] } } }",
    "{a=" * 2000,
    "1979-05-27T07:32:00Z",
    "07:32:00",
    "a.b.c",
    "#",
    "\x00",
)
RUDE_JSON: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    1,
    2**63,
    10**400,
    -0.5,
    1e308,
    float("nan"),
    float("inf"),
    "",
    "x",
    "x" * 100_000,
    "\x1b[2J\u202e",
    "\ud800",
    "../../etc/passwd",
    [],
    [[]],
    [None],
    [1, 2, 3],
    list(range(10_000)),
    {},
    {"a": 1},
    {"": {"": {}}},
)
_LONGEST = 5_000_000
_VALUE = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?|\"[^\"\n]*\"|true|false|\[[^\[\]\n]*\]")
_KEY = re.compile(r"^[\w\"-]+(?= =)", re.MULTILINE)


def bytes_changed(content: bytes, rng: random.Random) -> bytes:
    """Flip, insert, remove, double or cut some bytes."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 5, 30))):
        if not data:
            break
        start = rng.randrange(len(data))
        length = rng.choice((1, 1, 4, 50, 500))
        kind = rng.randrange(6)
        if kind == 0:
            data[start] ^= 1 << rng.randrange(8)
        elif kind == 1:
            data[start : start + length] = rng.randbytes(min(length, len(data) - start))
        elif kind == 2:
            del data[start : start + length]
        elif kind == 3:
            data[start:start] = data[start : start + length]
        elif kind == 4:
            data[start:start] = rng.randbytes(length)
        else:
            del data[start:]
    return bytes(data)


def text_changed(text: str, rng: random.Random, rude: tuple[str, ...] = RUDE_TOML) -> str:
    """Put rude values in place of good ones, or mix up keys and lines."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        kind = rng.randrange(10)
        if kind < 2:
            text = _swapped(_VALUE, text, _gentle(text, rng), rng)
        elif kind < 6:
            text = _swapped(_VALUE, text, rng.choice(rude), rng)
        elif kind == 6:
            text = _swapped(_KEY, text, rng.choice((*_KEY.findall(text), "a", '"\\u001b"')), rng)
        else:
            text = _lines_changed(text, rng)
        # Beyond all limits of the loaders, and no load on the memory that is measured.
        text = text[:_LONGEST]
    return text


def _gentle(text: str, rng: random.Random) -> str:
    """Return a value that may stand there: one of the file's own, or a number nearby."""
    value = str(rng.choice(_VALUE.findall(text) or ["1"]))
    try:
        number = float(value)
    except ValueError:
        return value
    return repr(number * rng.choice((-1, 0.5, 2, 10))) if "." in value else str(int(number) + 1)


def _swapped(what: re.Pattern[str], text: str, by: str, rng: random.Random) -> str:
    found = [*what.finditer(text)]
    if not found:
        return text + by
    place = rng.choice(found)
    return text[: place.start()] + by + text[place.end() :]


def _lines_changed(text: str, rng: random.Random) -> str:
    lines = text.splitlines(keepends=True) or [""]
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    kind = rng.randrange(5)
    if kind == 0:
        del lines[one]
    elif kind == 1:
        lines.insert(other, lines[one])
    elif kind == 2:
        lines[one], lines[other] = lines[other], lines[one]
    elif kind == 3:
        piece = lines[min(one, other) : max(one, other)]
        times = rng.choice((1, 2, 300))
        lines[one:one] = piece * min(times, 1 + _LONGEST // (1 + sum(map(len, piece))))
    else:
        lines[one] = lines[one].rstrip("\n")
    return "".join(lines)


def json_changed(value: Any, rng: random.Random) -> Any:
    """Put a rude value somewhere into a JSON value, or lose, double or add a key."""
    value = json.loads(json.dumps(value))
    for _ in range(rng.choice((1, 1, 1, 3))):
        place = rng.choice([*_places(value)] or [None])
        if place is None:
            return copy.deepcopy(rng.choice(RUDE_JSON))
        owner, key = place
        kind = rng.randrange(8)
        if kind == 0 and isinstance(owner, dict):
            del owner[key]
        elif kind == 1 and isinstance(owner, dict):
            owner[rng.choice(("a", "", "\x1b", "x" * 5000))] = copy.deepcopy(owner[key])
        elif kind == 2 and isinstance(owner, list):
            owner.extend(owner * rng.choice((1, 100)))
        elif kind == 3 and isinstance(owner, list):
            del owner[key]
        else:
            # A copy: what is put there may be changed next.
            owner[key] = copy.deepcopy(rng.choice(RUDE_JSON))
    return value


def _places(value: Any) -> Any:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    if isinstance(value, dict | list):
        for key, item in items:
            yield value, key
            if isinstance(item, dict | list):
                yield from _places(item)


def json_text_changed(text: str, rng: random.Random) -> str:
    """Change a JSON text as a value, or as a text."""
    kind = rng.randrange(6)
    if kind == 0:
        return text_changed(text, rng)
    if kind == 1:
        return bytes_changed(text.encode(), rng).decode("utf-8", "replace")
    if kind == 2:
        return rng.choice(("[" * 100_000, '{"a":' * 100_000, "9" * 5000, "", "nul", "NaN"))
    return json.dumps(json_changed(json.loads(text), rng))
