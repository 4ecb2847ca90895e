"""Flights as files and hashes: exact, without pickles, the same bytes for equal flights."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.errors import GarlError
from pytest_garl.landing_system import Detection, Diagnostics
from pytest_garl.simulation.flight import (
    Contact,
    Crash,
    Event,
    Flight,
    ObjectRecord,
    Separation,
    Step,
    Track,
)

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


def parted_s(first: Flight, second: Flight) -> float:
    """Return when two flights of the same scenario part: in a step, or else in the track."""
    steps = zip(first.steps, second.steps, strict=False)
    parted = next((a.time_s for a, b in steps if a != b), None)
    if parted is not None:
        return parted
    length = min(len(first.uav.time_s), len(second.uav.time_s))
    differ = (first.uav.position_m[:length] != second.uav.position_m[:length]).any(axis=1)
    return float(first.uav.time_s[int(np.argmax(differ)) if differ.any() else length - 1])


class NotFiniteError(GarlError):
    """A flight with a NaN or an infinity in it: it is written nowhere."""


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
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
        header = json.loads(arrays["header"].tobytes())
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise GarlError(f"{path}: not a saved flight: {error}") from error

    changes = header.get("changes") or [()] * len(header["objects"])

    def track(index: int) -> Track:
        return Track(**{name: arrays[f"{index}.{name}"] for name in _TRACK})

    return Flight(
        outcome=header["outcome"],
        final_distance_m=header["final_distance_m"],
        elapsed_s=header["elapsed_s"],
        marker_position_m=_pair(header["marker_position_m"]),
        uav=track(0),
        objects=tuple(
            ObjectRecord(
                name=name,
                type=kind,
                track=track(i),
                moves=arrays[f"{i}.moves"],
                changes=_tuple(changes[i - 1]),
            )
            for i, (name, kind) in enumerate(header["objects"], start=1)
        ),
        contacts=tuple(Contact(**_tuples(item)) for item in header["contacts"]),
        separations=tuple(Separation(**item) for item in header["separations"]),
        events=tuple(Event(**item) for item in header["events"]),
        steps=tuple(_step(item) for item in header["steps"]),
        decoys=tuple((name, x, y) for name, x, y in header["decoys"]),
        crash=Crash(**header["crash"]) if header["crash"] else None,
        sha256=header["sha256"],
        cpu=header["cpu"],
        versions=tuple((name, version) for name, version in header["versions"]),
        wall_s=header["wall_s"],
    )


def _step(item: dict[str, Any]) -> Step:
    thoughts = item.pop("diagnostics")
    diagnostics = None
    if thoughts is not None:
        seen = thoughts.pop("detections")
        diagnostics = Diagnostics(
            detections=tuple(Detection(**_tuples(each)) for each in seen), **_tuples(thoughts)
        )
    return Step(diagnostics=diagnostics, **_tuples(item))


def _tuples(item: dict[str, Any]) -> dict[str, Any]:
    return {key: _tuple(value) for key, value in item.items()}


def _tuple(value: Any) -> Any:
    return tuple(_tuple(each) for each in value) if isinstance(value, list) else value


def _pair(value: list[float]) -> tuple[float, float]:
    x, y = value
    return x, y
