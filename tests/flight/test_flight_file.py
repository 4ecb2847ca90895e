from __future__ import annotations

import dataclasses
import io
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl.airframe import Rangefinder
from pytest_garl.errors import GarlError
from pytest_garl.flight import flight_file
from pytest_garl.flight.flight import (
    Contact,
    Crash,
    Event,
    Flight,
    ObjectRecord,
    Separation,
    Step,
    Touchdown,
    Track,
)
from pytest_garl.flight.flight_file import load, save
from pytest_garl.landing_system import Detection, Diagnostics
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.support.flights import LAWN

Header = dict[str, Any]


def _track(length: int = 3) -> Track:
    return Track(
        time_s=np.arange(length) / 24,
        position_m=np.ones((length, 3)),
        attitude=np.tile([0.0, 0.0, 0.0, 1.0], (length, 1)),
        velocity_mps=np.zeros((length, 3)),
    )


def _touchdown(time_s: float) -> Touchdown:
    return Touchdown(
        time_s=time_s,
        position_m=(1.0, 0.5, 0.2),
        distance_m=2.5,
        speed_mps=0.5,
        tilt_rad=0.1,
        on="decoy-marker-3",
        slid_m=0.1,
        stopped_s=time_s + 1.4,
    )


def flight() -> Flight:
    seen = Detection(marker_id=3, confidence=0.5, position_m=(1.0, 2.0, 0.0))
    diagnostics = Diagnostics(
        phase="descend", detections=(seen,), planned_path_m=((0.0, 1.0, 2.0),)
    )
    return Flight(
        outcome="collision",
        final_distance_m=2.5,
        elapsed_s=14.0,
        marker_position_m=(1.0, -2.0),
        uav=_track(),
        objects=(
            ObjectRecord(
                name="dog-1",
                type="dog",
                track=_track(),
                moves=np.zeros((2, 2)),
                changes=((0, "environment.fog", 0.01),),
            ),
        ),
        contacts=(
            Contact(
                time_s=14.0,
                body="dog-1",
                kind="dog",
                body_class="dynamic",
                position_m=(0.0, 0.0, 1.0),
                speed_mps=1.0,
                tilt_rad=0.0,
            ),
        ),
        separations=(
            Separation(body="tree-1", kind="tree", body_class="static", distance_m=1.0, time_s=2.0),
        ),
        touchdown=_touchdown(9.0),
        earlier_touchdowns=(_touchdown(5.0), _touchdown(7.0)),
        events=(Event(time_s=1.0, name="took_off", text="left the ground"),),
        steps=(
            Step(
                time_s=0.1,
                command="Land",
                marker_visible=0.5,
                marker_px=20.0,
                objects_visible=("dog-1",),
                diagnostics=diagnostics,
                rangefinder_m=4.25,
            ),
        ),
        rangefinder=Rangefinder(least_m=0.3, most_m=6.0),
        decoys=(("marker-3", 1.0, 2.0),),
        crash=Crash(kind="raised", error="E", message="m", where="w", traceback="t"),
        sha256="ab",
        cpu="x",
        versions=(("numpy", "2"),),
        wall_s=1.0,
    )


def test_hash_covers_every_touchdown() -> None:
    whole = flight()
    hashes = {
        flight_file.hash_of(dataclasses.replace(whole, earlier_touchdowns=earlier, touchdown=last))
        for earlier in ((), whole.earlier_touchdowns[:1])
        for last in (None, whole.touchdown)
    }
    assert len(hashes) == 4


@pytest.fixture
def file(tmp_path: Path) -> Path:
    flight_file.save(flight(), tmp_path / "one.npz")
    return tmp_path / "one.npz"


def _rewritten(file: Path, change: Callable[[dict[str, Any], Header], None]) -> None:
    with np.load(file) as saved:
        arrays = dict(saved)
    header = json.loads(arrays.pop("header").tobytes())
    change(arrays, header)
    text = header if isinstance(header, str) else json.dumps(header)
    arrays.setdefault("header", np.frombuffer(text.encode(), dtype=np.uint8))
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    file.write_bytes(buffer.getvalue())


def test_a_flight_survives_its_file_to_the_byte(file: Path, tmp_path: Path) -> None:
    found = flight_file.load(file)
    assert flight_file.hash_of(found) == flight_file.hash_of(flight())
    names = ("contacts", "separations", "events", "steps", "decoys", "crash", "versions")
    for name in (*names, "touchdown", "earlier_touchdowns", "rangefinder"):
        assert getattr(found, name) == getattr(flight(), name)
    assert found.objects[0].changes == flight().objects[0].changes
    flight_file.save(found, tmp_path / "two.npz")
    assert (tmp_path / "two.npz").read_bytes() == file.read_bytes()


def test_a_file_in_which_nothing_changed_the_environment_is_read(file: Path) -> None:
    _rewritten(file, lambda _, header: header.pop("changes"))
    assert flight_file.load(file).objects[0].changes == ()


def test_obstacles_are_in_the_record_of_a_system_that_reports_them(file: Path) -> None:
    """The record of any other system is the same as without the field."""
    with np.load(file) as saved:
        assert b"obstacles_m" not in saved["header"].tobytes()
    first = flight().steps[0]
    assert first.diagnostics
    for obstacles in ((), ((1.0, 2.0, 0.5),)):
        said = dataclasses.replace(first.diagnostics, obstacles_m=obstacles)
        steps = (dataclasses.replace(first, diagnostics=said),)
        flight_file.save(dataclasses.replace(flight(), steps=steps), file)
        assert flight_file.load(file).steps == steps


def _set(key: str, value: Any) -> Callable[[Any, Header], None]:
    return lambda _, header: header.update({key: value})


def _array(key: str, value: Any) -> Callable[[dict[str, Any], Any], None]:
    return lambda arrays, _: arrays.update({key: value})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda _, header: header.pop("steps"), "the value: found other keys .*: steps"),
        (_set("outcome", "gone"), "outcome: found 'gone', expected one of 'landed'"),
        (_set("elapsed_s", "x" * 9000), "elapsed_s: found 'xxx.* expected a finite number"),
        (_set("marker_position_m", [1]), "marker_position_m: found .1., expected a list of 2"),
        (_set("objects", [["dog-1"]]), r"objects\[0\]: found \['dog-1'\], expected a list of 2"),
        (_set("objects", []), "found more arrays than 0 objects have: 1.attitude"),
        (_set("objects", [["dog-1", "dog"], ["a", "b"]]), "2.time_s: missing"),
        (_set("changes", []), "changes: found those of 0 objects, expected 1"),
        (_set("crash", {"kind": "raised"}), "crash: found other keys than expected"),
        (_set("steps", [[]]), r"steps\[0\]: found \[\], expected a table"),
        (_array("header", np.frombuffer(b"[" * 99_999, np.uint8)), "nested too deeply"),
        (_array("header", np.frombuffer(b"[]", np.uint8)), r"found \[\], expected a table"),
        (_array("0.time_s", np.empty(0)), "0.time_s: found no times"),
        (_array("0.time_s", np.zeros((3, 1))), r"0.time_s: found .* \(3, 1\), expected .* \(any\)"),
        (_array("1.attitude", np.zeros((2, 4))), r"1.attitude: found .* expected float64 of \(3,"),
        (_array("1.moves", np.zeros((2, 3))), r"1.moves: found .* of \(any, 2\)"),
        (_array("0.position_m", np.zeros((3, 3), np.float32)), "0.position_m: found float32"),
        (_array("0.position_m", np.full((3, 3), np.nan)), "0.position_m: found a number that is"),
        (_array("2.moves", np.zeros((2, 2))), "found more arrays than 1 objects have: 2.moves"),
    ],
)
def test_a_damaged_flight_is_one_short_error(
    file: Path, change: Callable[[Any, Any], None], words: str
) -> None:
    _rewritten(file, change)
    with pytest.raises(GarlError, match=words) as caught:
        flight_file.load(file)
    assert str(caught.value).startswith(f"{file}: not a saved flight: ")
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("damage", ["cut", "foreign", "missing", "pipe", "flipped"])
def test_a_file_that_is_no_flight_is_one_short_error(file: Path, damage: str) -> None:
    content = bytearray(file.read_bytes())
    file.unlink()
    # A byte of the packed header, the last array of the file.
    content[content.rindex(b"header.npy", 0, content.rindex(b"header.npy")) + 60] ^= 0x55
    if damage == "pipe":
        os.mkfifo(file)
    elif damage != "missing":
        file.write_bytes(
            {"cut": bytes(content[:-50]), "foreign": b"x", "flipped": bytes(content)}[damage]
        )
    with pytest.raises(GarlError, match=r"one\.npz: "):
        flight_file.load(file)


def test_a_flight_larger_than_the_memory_is_refused(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = file.stat().st_size
    monkeypatch.setattr(flight_file, "LARGEST_BYTES", size)
    assert flight_file.load(file).outcome == "collision"
    monkeypatch.setattr(flight_file, "LARGEST_BYTES", size - 1)
    with pytest.raises(GarlError, match=f"found {size} bytes, expected at most {size - 1}"):
        flight_file.load(file)
    monkeypatch.setattr(flight_file, "LARGEST_BYTES", size)
    monkeypatch.setattr(flight_file, "LARGEST_HEADER_BYTES", 100)
    with pytest.raises(GarlError, match=r"header: found .* bytes, expected at most 100"):
        flight_file.load(file)
    monkeypatch.setattr(flight_file, "LARGEST_UNPACKED_BYTES", 500)
    with pytest.raises(GarlError, match="bytes when unpacked, expected at most 500"):
        flight_file.load(file)


def test_a_flight_survives_its_file(tmp_path: Path) -> None:
    scenario = random_scenarios(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    flight = fly(scenario, ReferencePilot, policy_spec("waypoint"), time_limit_s=5)
    save(flight, tmp_path / "flight.npz")
    back = load(tmp_path / "flight.npz")
    for name in ("outcome", "sha256", "events", "steps", "contacts", "separations", "decoys"):
        assert getattr(back, name) == getattr(flight, name)
    assert (back.uav.position_m == flight.uav.position_m).all()
    assert (back.objects[0].moves == flight.objects[0].moves).all()
