"""Commands and thrusts are checked, and rebuilt from plain numbers."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl import (
    Airframe,
    AttitudeSetpoint,
    Command,
    Land,
    MotorThrusts,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.flight.flight_file import load, save
from pytest_garl.simulation.system_under_test.diagnostics import DiagnosticsQuota
from pytest_garl.simulation.system_under_test.validation import read_command, read_thrusts
from tests.support.answers import (
    HUGE,
    INF,
    NAN,
    diagnostics_with_detection,
    flight_of,
    flight_with,
    land_with,
)
from tests.support.flights import Scripted


class Raises:
    """Raises whatever is done with it."""

    def __str__(self) -> str:
        raise RuntimeError("no text")

    __repr__ = __str__

    def __float__(self) -> float:
        raise RuntimeError("no number")


class RaisingLand(Land):
    def __getattribute__(self, name: str) -> Any:
        if name == "speed_mps":
            raise ValueError("no speed")
        return super().__getattribute__(name)


class Changes(float):
    """A number that is fine when it is checked and not afterwards."""

    def __float__(self) -> float:
        return 1.0

    def __rsub__(self, other: float) -> float:
        return NAN

    __sub__ = __rmul__ = __mul__ = __rsub__


def to(*position: Any, **more: Any) -> PositionSetpoint:
    return PositionSetpoint(position_m=position, **more)


async def asynchronous() -> Command:
    return Land()


WRONG: list[tuple[Callable[[], Any], str, str]] = [
    # Limits of a setpoint.
    (lambda: to(0.0, 0.0, 1.0, acceleration_mps2=0.0), "BadCommand", "acceleration_mps2 = 0"),
    (lambda: to(0.0, 0.0, 1.0, acceleration_mps2=NAN), "BadCommand", "acceleration_mps2 = nan"),
    (lambda: to(0.0, 0.0, 1.0, tilt_rad=35.0), "BadCommand", "expected 0.02 to 0.61 rad"),
    (lambda: to(0.0, 0.0, 1.0, yaw_rad="north"), "BadCommand", "yaw_rad = 'north'"),
    # Diagnostics.
    (
        lambda: Land(diagnostics=diagnostics_with_detection(confidence=NAN)),
        "BadDiagnostics",
        "detections[0].confidence",
    ),
    (
        lambda: land_with(planned_path_m=((0.0, NAN, 0.0),)),
        "BadDiagnostics",
        "planned_path_m[0]",
    ),
    (
        lambda: Land(diagnostics=diagnostics_with_detection(corners_px=((INF, 0.0),))),
        "BadDiagnostics",
        "detections[0].corners_px[0]",
    ),
    (lambda: land_with(planned_path_m=((0.0, 1.0),)), "BadDiagnostics", "planned_path_m[0]"),
    (
        lambda: land_with(planned_path_m=itertools.repeat((0.0, 0.0, 0.0))),
        "BadDiagnostics",
        "1000",
    ),
    (lambda: land_with(obstacles_m=((0.0, NAN, 0.0),)), "BadDiagnostics", "obstacles_m[0]"),
    (lambda: land_with(detections=5), "BadDiagnostics", "detections = 5"),
    (lambda: land_with(detections=(5,)), "BadDiagnostics", "detections[0] = 5"),
    (
        lambda: Land(diagnostics=diagnostics_with_detection(marker_id=INF)),
        "BadDiagnostics",
        "marker_id = inf",
    ),
    (
        lambda: Land(diagnostics=diagnostics_with_detection(marker_id=2.5)),
        "BadDiagnostics",
        "marker_id = 2.5",
    ),
    (lambda: land_with(target_m=(0.0, 0.0, NAN)), "BadDiagnostics", "target_m"),
    (lambda: Land(diagnostics="low"), "BadDiagnostics", "diagnostics = 'low'"),  # type: ignore[arg-type]
    (lambda: land_with(phase=Raises()), "RuntimeError", "no text"),
    (lambda: land_with(note=Raises()), "RuntimeError", "no text"),
    # Commands.
    (lambda: asynchronous(), "BadCommand", "step is `async def`: it returned a coroutine"),
    (lambda: to(HUGE, 0.0, 2.0), "BadCommand", "position_m"),
    (lambda: to(1e9, 0.0, 2.0), "BadCommand", "expected each from -1000 to 1000 m"),
    (lambda: to(0.0, 2.0), "BadCommand", "expected 3 finite numbers"),
    (lambda: PositionSetpoint(position_m="abc"), "BadCommand", "position_m = 'abc'"),  # type: ignore[arg-type]
    (lambda: PositionSetpoint(position_m=itertools.count()), "BadCommand", "3 finite"),  # type: ignore[arg-type]
    (lambda: PositionSetpoint(position_m={1.0, 2.0, 3.0}), "BadCommand", "3 finite"),  # type: ignore[arg-type]
    (lambda: PositionSetpoint(position_m=np.zeros((3, 1))), "BadCommand", "3 finite"),  # type: ignore[arg-type]
    (lambda: to(Raises(), 0.0, 2.0), "RuntimeError", "no number"),
    (lambda: to(0.0, 0.0, 2.0, speed_mps=-1.0), "BadCommand", "speed_mps = -1.0"),
    (lambda: to(0.0, 0.0, 2.0, speed_mps=0), "BadCommand", "more than 0 m/s"),
    (lambda: to(0.0, 0.0, 2.0, speed_mps=1e6), "BadCommand", "expected 0 to 100 m/s"),
    (lambda: to(0.0, 0.0, 2.0, yaw_rad=INF), "BadCommand", "yaw_rad = inf"),
    (lambda: to(0.0, 0.0, 2.0, yaw_rad="north"), "BadCommand", "yaw_rad = 'north'"),
    (lambda: VelocitySetpoint(velocity_mps=(0.0, 0.0, 101.0)), "BadCommand", "velocity_mps"),
    (lambda: VelocitySetpoint(velocity_mps=(1j, 0.0, 0.0)), "BadCommand", "velocity_mps"),  # type: ignore[arg-type]
    (
        lambda: AttitudeSetpoint(attitude=(1e200, 0.0, 0.0, 1.0), thrust=0.5),
        "BadCommand",
        "unit quaternion",
    ),
    (
        lambda: AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 0.0), thrust=0.5),
        "BadCommand",
        "unit quaternion",
    ),
    (
        lambda: AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=1e200),
        "BadCommand",
        "thrust = 1e+200",
    ),
    (lambda: Land(speed_mps=-0.5), "BadCommand", "Land with speed_mps = -0.5"),
    (lambda: Raises(), "BadCommand", "<Raises instance at 0x...>"),
    (lambda: Land, "BadCommand", "expected one of PositionSetpoint"),
    (lambda: "x" * 10**6, "BadCommand", "step returned 'xxx"),
    (lambda: RaisingLand(), "ValueError", "no speed"),
]


@pytest.mark.parametrize(("answer", "error", "words"), WRONG, ids=range(len(WRONG)))
def test_wrong_value_is_a_finding_that_names_the_field(
    answer: Callable[[], Any], error: str, words: str, tmp_path: Path
) -> None:
    flight = flight_with(answer)
    assert flight.outcome == "crashed"
    assert flight.crash.error == error
    assert words in flight.crash.message
    assert len(flight.crash.message) < 400
    save(flight, tmp_path / "flight.npz")
    assert load(tmp_path / "flight.npz").sha256 == flight.sha256


HARMLESS: list[Callable[[], Any]] = [
    lambda: PositionSetpoint(position_m=(float(v) for v in (0, -16, 2))),  # type: ignore[arg-type]
    lambda: PositionSetpoint(position_m=np.array([0, -16, 2], np.float32)),  # type: ignore[arg-type]
    lambda: PositionSetpoint(position_m=[np.int64(0), np.float16(-16), True]),  # type: ignore[arg-type]
    lambda: VelocitySetpoint(velocity_mps=(Changes(), Changes(), Changes())),
    lambda: AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.04), thrust=np.float32(0.5)),  # type: ignore[arg-type]
    lambda: land_with(phase="x" * 10**6, note="\ud800" * 10**6),
    lambda: land_with(phase=object(), detections=[], planned_path_m=np.zeros((5, 3))),
    lambda: Land(
        diagnostics=diagnostics_with_detection(marker_id=np.int32(3), corners_px=np.zeros((4, 2)))
    ),
]


@pytest.mark.parametrize("answer", HARMLESS, ids=range(len(HARMLESS)))
def test_unusual_value_that_makes_sense_is_flown(answer: Callable[[], Any], tmp_path: Path) -> None:
    flight = flight_with(answer)
    assert flight.crash is None
    assert np.isfinite(flight.uav.position_m).all()
    save(flight, tmp_path / "flight.npz")
    assert load(tmp_path / "flight.npz").steps == flight.steps
    assert (tmp_path / "flight.npz").stat().st_size < 10**5


def test_command_is_rebuilt_from_plain_floats() -> None:
    class Own(PositionSetpoint):
        pass

    command = read_command(Own(position_m=np.zeros(3), speed_mps=Changes(2.0)), DiagnosticsQuota())  # type: ignore[arg-type]
    assert type(command) is PositionSetpoint
    assert {type(value) for value in (*command.position_m, command.speed_mps)} == {float}


def test_quaternion_is_made_one_of_length_one() -> None:
    command = read_command(
        AttitudeSetpoint(attitude=(0.0, 0.0, 0.54, 0.9), thrust=0.5), DiagnosticsQuota()
    )
    assert isinstance(command, AttitudeSetpoint)
    assert math.hypot(*command.attitude) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "newtons",
    [
        (HUGE, 0.0, 0.0, 0.0),
        (NAN, 0.0, 0.0, 0.0),
        (1.0, 1.0, 1.0, 206.1),
        (1.0, 1.0, 1.0),
        np.full(4, INF),
        None,
    ],
)
def test_wrong_thrusts_are_a_finding(newtons: Any) -> None:
    class Flies(Scripted):
        airframe = Airframe(control_rate_hz=240)

        def step(self, observation: Observation) -> Command:
            return self.hover(2.0)

        def control(self, state: Any) -> MotorThrusts:
            return MotorThrusts(newtons=newtons)

    crash = flight_of(Flies).crash
    assert crash.kind == "nonsense"
    assert "newtons" in crash.message


def test_thrusts_of_any_numbers_become_floats() -> None:
    thrusts = read_thrusts(MotorThrusts(newtons=np.arange(4)), 20.6)  # type: ignore[arg-type]
    assert thrusts == (0.0, 1.0, 2.0, 3.0)
    assert {type(value) for value in thrusts} == {float}


def test_physics_without_finite_numbers_end_the_flight_as_a_finding(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from pytest_garl.simulation.physics.bullet_world import BulletWorld

    where, step = BulletWorld.uav_state, BulletWorld.step
    steps = itertools.count()
    broken: list[int] = []

    def steps_on(self: BulletWorld, *forces: Any) -> None:
        step(self, *forces)
        broken.extend([1] if next(steps) > 100 else [])

    def nowhere(self: BulletWorld) -> Any:
        position, *rest = where(self)
        return ((NAN, *position[1:]) if broken else position), *rest

    monkeypatch.setattr(BulletWorld, "step", steps_on)
    monkeypatch.setattr(BulletWorld, "uav_state", nowhere)
    flight = flight_with(lambda: Land())
    assert (flight.crash.kind, flight.crash.error) == ("nonsense", "NotFinite")
    save(flight, tmp_path / "flight.npz")


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
