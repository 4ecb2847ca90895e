"""Arrays in .npz files, unpacked only where they are as large as they may be."""

from __future__ import annotations

import io
import math
import warnings
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.messages import shortened, shown

MOST_MEMBERS = 1000
"""More than the tracks of 150 objects, five arrays each, that a map can have at most."""
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def unpack(content: bytes, limit: int) -> dict[str, NDArray[Any]]:
    """Return the arrays of numbers in an .npz file, of at most ``limit`` bytes when unpacked.

    Nothing in it is run.  Raises ValueError for everything else that the bytes may be.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            _check(members, limit)
            return {
                member.filename.removesuffix(".npy"): _array(member, archive) for member in members
            }
    except ValueError as error:
        raise ValueError(shortened(str(error), 300)) from error
    except Exception as error:
        # Broken bytes make zipfile, zlib, tokenize and others raise a dozen kinds.
        name = type(error).__name__
        raise ValueError(f"no readable archive: {name}: {shortened(str(error))}") from error


def _check(members: list[zipfile.ZipInfo], limit: int) -> None:
    if len(members) > MOST_MEMBERS:
        raise ValueError(f"found {len(members)} members, expected at most {MOST_MEMBERS}")
    size = sum(member.file_size for member in members)
    if size > limit:
        raise ValueError(f"found {size} bytes when unpacked, expected at most {limit}")
    for member in members:
        if not member.filename.endswith(".npy"):
            raise ValueError(f"found the member {shown(member.filename)}, expected arrays (.npy)")
        # An archive that others unpack at once may be larger than it says.
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise ValueError(
                f"{shown(member.filename)}: found the compression {member.compress_type}, "
                "expected none or deflate"
            )


def _array(member: zipfile.ZipInfo, archive: zipfile.ZipFile) -> NDArray[Any]:
    with archive.open(member) as stream:
        # One byte more, so that the end is met, where the check sum is compared.
        content = stream.read(member.file_size + 1)
    file = io.BytesIO(content)
    version = np.lib.format.read_magic(file)
    if version not in _HEADERS:
        raise ValueError(f"{shown(member.filename)}: found the version {version}, expected 1 or 2")
    with warnings.catch_warnings():
        # Headers of Python 2 are read with a warning.
        warnings.simplefilter("error")
        shape, fortran, dtype = _HEADERS[version](file)
    data = content[file.tell() :]
    if dtype.kind not in "biuf":
        raise ValueError(f"{shown(member.filename)}: found values of {dtype}, expected numbers")
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != len(data):
        raise ValueError(
            f"{shown(member.filename)}: found {len(data)} bytes for the shape {shown(shape)} of "
            f"{dtype}"
        )
    # A copy, since the bytes cannot be written to.
    array = np.array(np.frombuffer(data, dtype)) if data else np.empty(0, dtype)
    return array.reshape(shape, order="F" if fortran else "C")
