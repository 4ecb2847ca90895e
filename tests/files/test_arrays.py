from __future__ import annotations

import io
import pickle
import struct
import zipfile
from typing import Any

import numpy as np
import pytest

from pytest_garl.files.arrays import MOST_MEMBERS, unpack

LIMIT = 100_000


def packed(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def archive(name: str, content: bytes, compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as file:
        file.writestr(name, content)
    return buffer.getvalue()


def npy(array: Any) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def test_arrays_survive_their_file_to_the_byte() -> None:
    arrays: dict[str, Any] = {
        "a": np.arange(12.0).reshape(3, 4),
        "fortran": np.asfortranarray(np.arange(6, dtype=np.int32).reshape(2, 3)),
        "empty": np.empty((0, 2)),
        "scalar": np.float32(0.5),
        "bytes": np.frombuffer(b"header", dtype=np.uint8),
        "bools": np.array([True, False]),
    }
    found = unpack(packed(**arrays), LIMIT)
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        assert found[name].dtype == np.asarray(array).dtype
        assert found[name].shape == np.shape(array)
        assert (found[name] == array).all()
    found["a"][0, 0] = 7.0


def _header(shape: str, descr: str = "'<f8'", data: bytes = b"") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def _lying_size() -> bytes:
    """Return an archive whose directory says that a member is far smaller than it is."""
    content = bytearray(archive("a.npy", npy(np.zeros(1_000_000))))
    start = content.rindex(b"PK\x01\x02")
    content[start + 24 : start + 28] = struct.pack("<I", 1000)
    return bytes(content)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no readable archive: BadZipFile"),
        (b"no archive", "no readable archive: BadZipFile: File is not a zip file"),
        (packed(a=np.zeros(10))[:-30], "no readable archive"),
        (packed(a=np.zeros(20_000)), r"found 160128 bytes when unpacked, expected at most 100000"),
        (_lying_size(), "found .* for the shape|no readable archive"),
        (archive("a.txt", b"x"), "found the member 'a.txt', expected arrays"),
        (archive("../a", b"x"), "found the member '../a', expected arrays"),
        (archive("a.npy", npy(1.0), zipfile.ZIP_BZIP2), "found the compression 12, expected none"),
        (archive("a.npy", npy(1.0), zipfile.ZIP_LZMA), "found the compression 14, expected none"),
        (archive("a.npy", b"no array"), "magic string"),
        (archive("a.npy", b""), "EOF"),
        (archive("a.npy", b"\x93NUMPY\x03\x00"), r"found the version \(3, 0\), expected 1 or 2"),
        (archive("a.npy", _header("(1000000000000,)")), r"found 0 bytes for the shape \(10000"),
        (archive("a.npy", _header("(-1, -8)", data=b"8" * 64)), "found 64 bytes for the shape"),
        (archive("a.npy", _header("(2,)", "'|O'", b"x" * 16)), "found values of object, expected"),
        (archive("a.npy", _header("(1,)", "'<U4'", b"x" * 16)), "found values of <U4, expected"),
        (archive("a.npy", _header("(" * 300)), "no readable archive|Cannot parse header"),
        (archive("a.npy", _header("__import__('os').abort()")), "malformed node|Cannot parse"),
        (archive("a.npy", _header("(2L,)", data=b"8" * 16)), "UserWarning|Cannot parse"),
        (archive("a.npy", pickle.dumps([1])), "magic string"),
    ],
)
def test_other_bytes_are_one_short_error(content: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        unpack(content, LIMIT)
    assert len(str(caught.value)) <= 300


def test_no_more_members_than_a_flight_can_have() -> None:
    some = {f"a{index}": np.zeros(1) for index in range(MOST_MEMBERS + 1)}
    with pytest.raises(ValueError, match="found 1001 members, expected at most 1000"):
        unpack(packed(**some), 10**9)
    some.popitem()
    assert len(unpack(packed(**some), 10**9)) == MOST_MEMBERS


def test_the_limit_is_exact() -> None:
    content = packed(a=np.zeros(100))
    size = 128 + 800
    assert unpack(content, size)["a"].shape == (100,)
    with pytest.raises(ValueError, match=f"found {size} bytes when unpacked, expected at most"):
        unpack(content, size - 1)


def test_a_flipped_byte_never_gives_other_numbers() -> None:
    array = np.random.default_rng(1).normal(size=20)
    content = packed(a=array)
    refused = 0
    for index in range(len(content)):
        damaged = bytearray(content)
        damaged[index] ^= 0x40
        try:
            found = unpack(bytes(damaged), LIMIT)
        except ValueError:
            refused += 1
        else:
            assert all((each == array).all() for each in found.values())
    assert refused > len(content) / 2
