"""Flights as files and hashes: exact, without pickles, the same bytes for equal flights."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.errors import GarlError, NotFiniteError
from pytest_garl.files.arrays import unpack
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.files.reading import MEGABYTE, read_bytes
from pytest_garl.messages import listed
from pytest_garl.simulation.flight import (
    Contact,
    Crash,
    Event,
    Flight,
    ObjectRecord,
    Outcome,
    Separation,
    Step,
    Track,
)

Array = NDArray[Any]
LARGEST_BYTES = 32 * MEGABYTE
LARGEST_UNPACKED_BYTES = 128 * MEGABYTE
"""The tracks of 150 objects over five minutes are 95 megabytes."""
LARGEST_HEADER_BYTES = 32 * MEGABYTE
"""What landing systems tell of their diagnostics is some kilobytes a frame; reading takes ten times
as much memory."""
_TRACK = ("time_s", "position_m", "attitude", "velocity_mps")


def hash_of(flight: Flight) -> str:
    """Return the SHA-256 of outcome, tracks, moves, changes of the environment and contacts."""
    digest = hashlib.sha256()
    head = (flight.outcome, flight.final_distance_m, flight.elapsed_s, flight.marker_position_m)
    digest.update(repr(head).encode())
    for track in (flight.uav, *(item.track for item in flight.objects)):
        for name in _TRACK:
            digest.update(np.ascontiguousarray(getattr(track, name)).tobytes())
    for item in flight.objects:
        digest.update(np.ascontiguousarray(item.moves).tobytes())
        if item.changes:
            digest.update(repr(item.changes).encode())
    for contact in flight.contacts:
        digest.update(repr(dataclasses.astuple(contact)).encode())
    return digest.hexdigest()


def divergence_time_s(first: Flight, second: Flight) -> float:
    """Return when two flights of the same scenario part: in a step, or else in the track."""
    steps = zip(first.steps, second.steps, strict=False)
    parted = next((a.time_s for a, b in steps if a != b), None)
    if parted is not None:
        return parted
    length = min(len(first.uav.time_s), len(second.uav.time_s))
    differ = (first.uav.position_m[:length] != second.uav.position_m[:length]).any(axis=1)
    return float(first.uav.time_s[int(np.argmax(differ)) if differ.any() else length - 1])


def save(flight: Flight, path: Path) -> None:
    """Write the flight atomically as one .npz that holds arrays and a JSON header.

    Raises NotFiniteError for a flight that is not one of finite numbers.
    """
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    for index, track in enumerate((flight.uav, *(item.track for item in flight.objects))):
        for name in _TRACK:
            arrays[f"{index}.{name}"] = getattr(track, name)
    for index, item in enumerate(flight.objects, start=1):
        arrays[f"{index}.moves"] = item.moves
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise NotFiniteError(f"the flight's record holds a NaN or an infinity in {name}")
    header: dict[str, Any] = {
        "outcome": flight.outcome,
        "final_distance_m": flight.final_distance_m,
        "elapsed_s": flight.elapsed_s,
        "marker_position_m": flight.marker_position_m,
        "objects": [[item.name, item.type] for item in flight.objects],
        "contacts": [dataclasses.asdict(item) for item in flight.contacts],
        "separations": [dataclasses.asdict(item) for item in flight.separations],
        "events": [dataclasses.asdict(item) for item in flight.events],
        "steps": [dataclasses.asdict(item) for item in flight.steps],
        "decoys": flight.decoys,
        "crash": dataclasses.asdict(flight.crash) if flight.crash else None,
        "sha256": flight.sha256,
        "cpu": flight.cpu,
        "versions": flight.versions,
        "wall_s": flight.wall_s,
    }
    if any(item.changes for item in flight.objects):
        header["changes"] = [item.changes for item in flight.objects]
    try:
        text = json.dumps(header, allow_nan=False)
    except ValueError:
        held = ", ".join(name for name, value in header.items() if _holds_nan(value))
        raise NotFiniteError(f"the flight's record holds a NaN or an infinity in {held}") from None
    arrays["header"] = np.frombuffer(text.encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    scratch.write_bytes(buffer.getvalue())
    scratch.replace(path)


def _holds_nan(value: Any) -> bool:
    try:
        json.dumps(value, allow_nan=False)
    except ValueError:
        return True
    return False


def load(path: Path) -> Flight:
    """Return a saved flight; raise GarlError for a file that is none."""
    content = read_bytes(path, LARGEST_BYTES, GarlError)
    try:
        arrays = unpack(content, LARGEST_UNPACKED_BYTES)
        header = arrays.pop("header", np.empty(0))
        if header.nbytes > LARGEST_HEADER_BYTES:
            raise ValueError(
                f"header: found {header.nbytes} bytes, expected at most {LARGEST_HEADER_BYTES}"
            )
        values = parse_json(header.tobytes())
        # Files of flights in which no policy changed the environment do not have it.
        if isinstance(values, dict):
            values = {"changes": None, **values}
        return _flight(dataclass_from(_Header, values), arrays)
    except ValueError as error:
        raise GarlError(f"{path}: not a saved flight: {error}") from error


def _flight(told: _Header, arrays: dict[str, Array]) -> Flight:
    count = len(told.objects)
    changes = told.changes if told.changes is not None else ((),) * count
    tracks = [_track(arrays, index) for index in range(count + 1)]
    moves = [_array(arrays, f"{index + 1}.moves", (-1, 2)) for index in range(count)]
    if arrays:
        raise ValueError(f"found more arrays than {count} objects have: {listed(sorted(arrays))}")
    if len(changes) != count:
        raise ValueError(f"changes: found those of {len(changes)} objects, expected {count}")
    values = {name: getattr(told, name) for name in _SAME}
    return Flight(
        uav=tracks[0],
        objects=tuple(
            ObjectRecord(name=name, type=kind, track=track, moves=own, changes=changed)
            for (name, kind), track, own, changed in zip(
                told.objects, tracks[1:], moves, changes, strict=True
            )
        ),
        **values,
    )


def _track(arrays: dict[str, Array], index: int) -> Track:
    time_s = _array(arrays, f"{index}.time_s", (-1,))
    length = len(time_s)
    if not length:
        raise ValueError(f"{index}.time_s: found no times, expected one at least")
    return Track(
        time_s=time_s,
        position_m=_array(arrays, f"{index}.position_m", (length, 3)),
        attitude=_array(arrays, f"{index}.attitude", (length, 4)),
        velocity_mps=_array(arrays, f"{index}.velocity_mps", (length, 3)),
    )


def _array(arrays: dict[str, Array], name: str, shape: tuple[int, ...]) -> Array:
    """Take a float64 array of finite numbers; -1 in the shape stands for any length."""
    if name not in arrays:
        raise ValueError(f"{name}: missing")
    found = arrays.pop(name)
    alike = found.ndim == len(shape) and all(
        want in (-1, size) for size, want in zip(found.shape, shape, strict=True)
    )
    if not alike or found.dtype != np.float64:
        words = ", ".join("any" if want == -1 else str(want) for want in shape)
        raise ValueError(
            f"{name}: found {found.dtype} of the shape {found.shape}, expected float64 of ({words})"
        )
    if not np.isfinite(found).all():
        raise ValueError(f"{name}: found a number that is not finite")
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class _Header:
    """What of a flight is no array."""

    outcome: Outcome
    final_distance_m: float
    elapsed_s: float
    marker_position_m: tuple[float, float]
    objects: tuple[tuple[str, str], ...]
    contacts: tuple[Contact, ...]
    separations: tuple[Separation, ...]
    events: tuple[Event, ...]
    steps: tuple[Step, ...]
    decoys: tuple[tuple[str, float, float], ...]
    crash: Crash | None
    sha256: str
    cpu: str
    versions: tuple[tuple[str, str], ...]
    wall_s: float
    changes: tuple[tuple[tuple[int, str, float], ...], ...] | None


_SAME = tuple(
    field.name for field in dataclasses.fields(_Header) if field.name not in ("objects", "changes")
)
