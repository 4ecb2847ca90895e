"""Changes of good files as a broken disk, a bad merge or a hostile stranger makes them."""

from __future__ import annotations

import copy
import io
import json
import random
import re
import sqlite3
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

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


def archive_changed(content: bytes, rng: random.Random) -> bytes:
    """Change the bytes of an .npz file, its members, or the arrays in them."""
    kind = rng.randrange(4)
    if kind == 0:
        return bytes_changed(content, rng)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    if kind == 1:
        name = rng.choice([*members])
        members[name] = bytes_changed(members[name][:128], rng) + members[name][128:]
    elif kind == 2:
        _members_changed(members, rng)
    else:
        _array_changed(members, rng)
    return _packed(members, rng)


def _packed(members: dict[str, bytes], rng: random.Random) -> bytes:
    buffer = io.BytesIO()
    compression = rng.choice((zipfile.ZIP_DEFLATED,) * 6 + (zipfile.ZIP_STORED, zipfile.ZIP_LZMA))
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    data = bytearray(buffer.getvalue())
    if rng.random() < 0.1:
        # A directory that says another size, kind or place than the member has.
        start = data.rfind(b"PK\x01\x02") + rng.choice((8, 10, 20, 24, 42))
        data[start : start + 4] = rng.randbytes(4)
    return bytes(data)


def _members_changed(members: dict[str, bytes], rng: random.Random) -> None:
    name = rng.choice([*members])
    kind = rng.randrange(6)
    if kind == 0:
        del members[name]
    elif kind == 1:
        members[rng.choice(("a.npy", "../a.npy", "\x1b.npy", "a", "9.moves.npy"))] = members[name]
    elif kind == 2:
        members[name] = rng.choice((b"", b"x", b"\x80\x04N.", b"\x93NUMPY\x01\x00\xff\xff{"))
    elif kind == 3:
        members.update({f"{index}.npy": b"" for index in range(2000)})
    elif kind == 4:
        members[name] = bytes(20_000_000)
    else:
        other = rng.choice([*members])
        members[name], members[other] = members[other], members[name]


def _array_changed(members: dict[str, bytes], rng: random.Random) -> None:
    name = rng.choice([*members])
    array = np.load(io.BytesIO(members[name]))
    wrong: list[Callable[[], Any]] = [
        lambda: array.astype(rng.choice(("f4", "f2", "i8", "c16", ">f8", "U4", "b1"))),
        lambda: array[:0],
        lambda: array[..., None],
        lambda: array.reshape(-1),
        lambda: np.float64(1.0),
        lambda: np.full(array.shape, rng.choice((np.nan, np.inf, 1e300))),
        lambda: np.zeros((rng.choice((0, 1, 7, 100_000)), rng.choice((1, 2, 3, 4)))),
        lambda: np.array(["x", None], dtype=object),
        lambda: np.zeros(3, dtype=[("a", "f8")]),
    ]
    buffer = io.BytesIO()
    np.save(buffer, rng.choice(wrong)(), allow_pickle=True)
    members[name] = buffer.getvalue()


def database_changed(path: Path, rng: random.Random) -> None:
    """Damage pages of an SQLite file, or put rude values into its cells."""
    kind = rng.randrange(3)
    if kind == 0:
        _pages_changed(path, rng)
        return
    database = sqlite3.connect(path, isolation_level=None)
    try:
        for _ in range(rng.choice((1, 1, 2))):
            _cell_changed(database, rng)
    except (sqlite3.Error, OverflowError):
        # A value that the table's own rules refuse.
        pass
    finally:
        database.close()


def _pages_changed(path: Path, rng: random.Random) -> None:
    data = bytearray(path.read_bytes())
    for _ in range(rng.choice((1, 1, 3, 10))):
        start = rng.randrange(0, max(1, len(data)), 512)
        kind = rng.randrange(6)
        if kind == 0:
            data[start : start + 4096] = bytes(4096)
        elif kind == 1:
            data[start : start + 64] = rng.randbytes(64)
        elif kind == 2:
            other = rng.randrange(0, max(1, len(data)), 4096)
            data[start : start + 4096] = data[other : other + 4096]
        elif kind == 3:
            del data[start:]
        elif kind == 4 and data:
            for _ in range(20):
                data[rng.randrange(len(data))] = rng.randrange(256)
        else:
            data[:100] = bytes_changed(bytes(data[:100]), rng)
    path.write_bytes(data)


def _cell_changed(database: sqlite3.Connection, rng: random.Random) -> None:
    tables = [name for (name,) in database.execute("SELECT name FROM sqlite_master")]
    table = rng.choice(
        [name for name in tables if not name.startswith("sqlite") and "_" not in name]
    )
    kind = rng.randrange(12)
    if kind == 0:
        database.execute(f"DROP TABLE {table}")
        return
    if kind == 1:
        database.execute(f"DELETE FROM {table} WHERE random() % 2")
        return
    columns = [row[1] for row in database.execute(f"PRAGMA table_info({table})")]
    column = rng.choice(columns)
    rows = database.execute(f"SELECT rowid, {column} FROM {table}").fetchall()
    rowid, value = rng.choice(rows or [(0, None)])
    if isinstance(value, str) and value[:1] in ("{", "[") and rng.random() < 0.8:
        changed: Any = json_text_changed(value, rng)
    else:
        changed = rng.choice(
            (
                None,
                0,
                -1,
                2**62,
                0.5,
                float("inf"),
                "",
                "x",
                "\x1b[2J",
                "{}",
                "[]",
                b"\xff\x00",
                "9" * 5000,
            )
        )
    database.execute(f"UPDATE {table} SET {column} = ? WHERE rowid = ?", (changed, rowid))
