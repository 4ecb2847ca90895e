"""Files and hashes of flights: exact, without pickles, equal bytes for equal flights."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import io
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.airframe import Rangefinder
from pytest_garl.errors import GarlError, NotFiniteError
from pytest_garl.files.arrays import unpack
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.files.user_files import MEGABYTE, read_bytes
from pytest_garl.flight.flight import (
    Contact,
    Crash,
    Event,
    Flight,
    NominalView,
    ObjectRecord,
    Outcome,
    Separation,
    Step,
    Touchdown,
    Track,
)
from pytest_garl.landing_system import Diagnostics
from pytest_garl.messages import listed

Array = NDArray[Any]
LARGEST_BYTES = 32 * MEGABYTE
LARGEST_UNPACKED_BYTES = 128 * MEGABYTE
"""The tracks of 150 objects over five minutes are 95 megabytes."""
LARGEST_HEADER_BYTES = 32 * MEGABYTE
"""The diagnostics of landing systems take some kilobytes per frame; reading them takes ten times as
much memory."""
_TRACK_FIELDS = ("time_s", "position_m", "attitude", "velocity_mps")


def hash_of(flight: Flight) -> str:
    """Return the SHA-256 of outcome, tracks, moves, changes of the environment and contacts."""
    digest = hashlib.sha256()
    head = (flight.outcome, flight.final_distance_m, flight.elapsed_s, flight.marker_position_m)
    digest.update(repr(head).encode())
    for track in (flight.uav, *(item.track for item in flight.objects)):
        for name in _TRACK_FIELDS:
            digest.update(np.ascontiguousarray(getattr(track, name)).tobytes())
    for item in flight.objects:
        digest.update(np.ascontiguousarray(item.moves).tobytes())
        if item.changes:
            digest.update(repr(item.changes).encode())
    for contact in flight.contacts:
        digest.update(repr(dataclasses.astuple(contact)).encode())
    for touchdown in (*flight.earlier_touchdowns, flight.touchdown):
        if touchdown:
            digest.update(repr(dataclasses.astuple(touchdown)).encode())
    return digest.hexdigest()


def divergence_time_s(first: Flight, second: Flight) -> float:
    """Return the time from which two flights of a scenario differ: in a step, else in the track."""
    steps = zip(first.steps, second.steps, strict=False)
    differs_s = next((a.time_s for a, b in steps if a != b), None)
    if differs_s is not None:
        return differs_s
    length = min(len(first.uav.time_s), len(second.uav.time_s))
    differ = (first.uav.position_m[:length] != second.uav.position_m[:length]).any(axis=1)
    return float(first.uav.time_s[int(np.argmax(differ)) if differ.any() else length - 1])


def save(flight: Flight, path: Path) -> None:
    """Write the flight atomically as one .npz file with arrays and a JSON header.

    Raises NotFiniteError if the flight holds a NaN or an infinity.
    """
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    for index, track in enumerate((flight.uav, *(item.track for item in flight.objects))):
        for name in _TRACK_FIELDS:
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
        "contacts": flight.contacts,
        "separations": flight.separations,
        "events": flight.events,
        "steps": flight.steps,
        "decoys": flight.decoys,
        "crash": flight.crash,
        "touchdown": flight.touchdown,
        "earlier_touchdowns": flight.earlier_touchdowns,
        "nominal_views": flight.nominal_views,
        "nominal_arrival_s": flight.nominal_arrival_s,
        "nominal_landing_s": flight.nominal_landing_s,
        "rangefinder": flight.rangefinder,
        "data_read": flight.data_read,
        "conditions": flight.conditions,
        "moments": flight.moments,
        "sha256": flight.sha256,
        "cpu": flight.cpu,
        "versions": flight.versions,
        "wall_s": flight.wall_s,
    }
    if any(item.changes for item in flight.objects):
        header["changes"] = [item.changes for item in flight.objects]
    try:
        text = json.dumps(header, default=_fields, allow_nan=False)
    except ValueError:
        held = ", ".join(name for name, value in header.items() if _holds_nan(value))
        raise NotFiniteError(f"the flight's record holds a NaN or an infinity in {held}") from None
    arrays["header"] = np.frombuffer(text.encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    path.parent.mkdir(parents=True, exist_ok=True)
    incomplete = path.with_name(f".{path.name}.{os.getpid()}")
    incomplete.write_bytes(buffer.getvalue())
    incomplete.replace(path)


def _fields(value: Any) -> dict[str, Any]:
    """Return the fields of a dataclass; ``dataclasses.asdict`` would copy each of their values."""
    # For mypy a class cannot be hashed, though each can.
    fields = {name: getattr(value, name) for name in _names(type(value))}  # type: ignore[arg-type]
    if isinstance(value, Diagnostics) and value.obstacles_m is None:
        del fields["obstacles_m"]
    return fields


@functools.cache
def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kind))


def _holds_nan(value: Any) -> bool:
    try:
        json.dumps(value, default=_fields, allow_nan=False)
    except ValueError:
        return True
    return False


def load(path: Path) -> Flight:
    """Return a saved flight; raise GarlError if the file is not valid."""
    content = read_bytes(path, LARGEST_BYTES, GarlError)
    try:
        arrays = unpack(content, LARGEST_UNPACKED_BYTES)
        header = arrays.pop("header", np.empty(0))
        if header.nbytes > LARGEST_HEADER_BYTES:
            raise ValueError(
                f"header: found {header.nbytes} bytes, expected at most {LARGEST_HEADER_BYTES}"
            )
        values = parse_json(header.tobytes())
        # The key is missing if no policy changed the environment in the flight.
        if isinstance(values, dict):
            values = {"changes": None, **values}
            _add_obstacles(values.get("steps"))
        return _flight(dataclass_from(_Header, values), arrays)
    except ValueError as error:
        raise GarlError(f"{path}: not a saved flight: {error}") from error


def _add_obstacles(steps: Any) -> None:
    """Add the key that is missing in the diagnostics of systems that report no obstacles."""
    for step in steps if isinstance(steps, list) else ():
        if isinstance(step, dict) and isinstance(step.get("diagnostics"), dict):
            step["diagnostics"].setdefault("obstacles_m", None)


def _flight(header: _Header, arrays: dict[str, Array]) -> Flight:
    count = len(header.objects)
    changes = header.changes if header.changes is not None else ((),) * count
    tracks = [_track(arrays, index) for index in range(count + 1)]
    moves = [_array(arrays, f"{index + 1}.moves", (-1, 2)) for index in range(count)]
    if arrays:
        raise ValueError(f"found more arrays than {count} objects have: {listed(sorted(arrays))}")
    if len(changes) != count:
        raise ValueError(f"changes: found those of {len(changes)} objects, expected {count}")
    values = {name: getattr(header, name) for name in _COPIED_FIELDS}
    return Flight(
        uav=tracks[0],
        objects=tuple(
            ObjectRecord(name=name, type=kind, track=track, moves=own, changes=changed)
            for (name, kind), track, own, changed in zip(
                header.objects, tracks[1:], moves, changes, strict=True
            )
        ),
        **values,
    )


def _track(arrays: dict[str, Array], index: int) -> Track:
    time_s = _array(arrays, f"{index}.time_s", (-1,))
    length = len(time_s)
    if not length:
        raise ValueError(f"{index}.time_s: found no times, expected at least one")
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
    shape_fits = found.ndim == len(shape) and all(
        want in (-1, size) for size, want in zip(found.shape, shape, strict=True)
    )
    if not shape_fits or found.dtype != np.float64:
        words = ", ".join("any" if want == -1 else str(want) for want in shape)
        raise ValueError(
            f"{name}: found {found.dtype} of the shape {found.shape}, expected float64 of ({words})"
        )
    if not np.isfinite(found).all():
        raise ValueError(f"{name}: found a number that is not finite")
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class _Header:
    """The values of a flight that are not arrays."""

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
    touchdown: Touchdown | None
    earlier_touchdowns: tuple[Touchdown, ...]
    nominal_views: tuple[NominalView, ...]
    nominal_arrival_s: float | None
    nominal_landing_s: float | None
    rangefinder: Rangefinder | None
    data_read: tuple[str, ...] | None
    conditions: tuple[str, ...]
    moments: tuple[tuple[str, float], ...]
    sha256: str
    cpu: str
    versions: tuple[tuple[str, str], ...]
    wall_s: float
    changes: tuple[tuple[tuple[int, str, float], ...], ...] | None


_COPIED_FIELDS = tuple(
    field.name for field in dataclasses.fields(_Header) if field.name not in ("objects", "changes")
)
