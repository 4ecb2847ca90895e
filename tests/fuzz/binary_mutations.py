"""Changes of good archives and databases, byte by byte and cell by cell."""

from __future__ import annotations

import io
import random
import sqlite3
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.mutations import bytes_changed, json_text_changed


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
            # Written by its name alone, a member would carry the time of day.
            archive.writestr(zipfile.ZipInfo(name), content, compression)
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
