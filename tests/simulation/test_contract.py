"""Whatever a landing system returns, declares or raises, the flight ends in a record."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl import (
    Abort,
    Airframe,
    AttitudeSetpoint,
    Camera,
    Command,
    Detection,
    Diagnostics,
    Land,
    MotorThrusts,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.errors import LandingSystemError
from pytest_garl.landing_system import airframe_of
from pytest_garl.simulation.flight_file import load, save
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test import diagnostics
from pytest_garl.simulation.system_under_test.diagnostics import Room
from pytest_garl.simulation.system_under_test.reading import NonsenseError
from pytest_garl.simulation.system_under_test.validation import read_command, read_thrusts
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.simulation.test_flight import EMPTY, STAND, Scripted, nominal

NAN, INF, HUGE = math.nan, math.inf, 10**400


class Answers(Scripted):
    """Returns what a test puts here."""

    answer: Callable[[], Any]

    def step(self, observation: Observation) -> Any:
        return type(self).answer()


def flight_of(system: type, seconds: float = 1.0) -> Any:
    return fly(nominal(), system, STAND, map=EMPTY, time_limit_s=seconds)


def flight_with(answer: Callable[[], Any]) -> Any:
    return flight_of(type("Answers", (Answers,), {"answer": staticmethod(answer)}))


def seen(**changes: Any) -> Diagnostics:
    sighting: dict[str, Any] = {
        "marker_id": 0,
        "confidence": 1.0,
        "position_m": (0.0, 0.0, 0.0),
    } | changes
    return Diagnostics(detections=(Detection(**sighting),))


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


def told(**diagnostics: Any) -> Land:
    return Land(diagnostics=Diagnostics(**diagnostics))


WRONG: list[tuple[Callable[[], Any], str, str]] = [
    # Diagnostics.
    (lambda: Land(diagnostics=seen(confidence=NAN)), "BadDiagnostics", "detections[0].confidence"),
    (lambda: told(planned_path_m=((0.0, NAN, 0.0),)), "BadDiagnostics", "planned_path_m[0]"),
    (
        lambda: Land(diagnostics=seen(corners_px=((INF, 0.0),))),
        "BadDiagnostics",
        "detections[0].corners_px[0]",
    ),
    (lambda: told(planned_path_m=((0.0, 1.0),)), "BadDiagnostics", "planned_path_m[0]"),
    (lambda: told(planned_path_m=itertools.repeat((0.0, 0.0, 0.0))), "BadDiagnostics", "1000"),
    (lambda: told(detections=5), "BadDiagnostics", "detections = 5"),
    (lambda: told(detections=(5,)), "BadDiagnostics", "detections[0] = 5"),
    (lambda: Land(diagnostics=seen(marker_id=INF)), "BadDiagnostics", "marker_id = inf"),
    (lambda: Land(diagnostics=seen(marker_id=2.5)), "BadDiagnostics", "marker_id = 2.5"),
    (lambda: told(target_m=(0.0, 0.0, NAN)), "BadDiagnostics", "target_m"),
    (lambda: Land(diagnostics="low"), "BadDiagnostics", "diagnostics = 'low'"),  # type: ignore[arg-type]
    (lambda: told(phase=Raises()), "RuntimeError", "no text"),
    (lambda: told(note=Raises()), "RuntimeError", "no text"),
    # Commands.
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
    lambda: told(phase="x" * 10**6, note="\ud800" * 10**6),
    lambda: told(phase=object(), detections=[], planned_path_m=np.zeros((5, 3))),
    lambda: Land(diagnostics=seen(marker_id=np.int32(3), corners_px=np.zeros((4, 2)))),
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

    command = read_command(Own(position_m=np.zeros(3), speed_mps=Changes(2.0)), Room())  # type: ignore[arg-type]
    assert type(command) is PositionSetpoint
    assert {type(value) for value in (*command.position_m, command.speed_mps)} == {float}


def test_quaternion_is_made_one_of_length_one() -> None:
    command = read_command(AttitudeSetpoint(attitude=(0.0, 0.0, 0.54, 0.9), thrust=0.5), Room())
    assert isinstance(command, AttitudeSetpoint)
    assert math.hypot(*command.attitude) == pytest.approx(1.0)


def test_text_is_cut_and_says_so() -> None:
    command = read_command(told(phase="p" * 200, note="n" * 2_000), Room())
    assert command.diagnostics
    assert command.diagnostics.phase == "p" * 100 + "... (cut, 200 characters)"
    assert command.diagnostics.note.endswith("n... (cut, 2000 characters)")


def test_long_path_is_thinned_to_its_first_and_last_and_what_lies_between() -> None:
    for count in (0, 1, 99, 100, 101, 199, 1_000):
        path = tuple((float(index), 0.0, 0.0) for index in range(count))
        command = read_command(told(planned_path_m=path), Room())
        assert command.diagnostics
        kept = command.diagnostics.planned_path_m
        assert len(kept) <= 100
        assert (kept[:1], kept[-1:]) == (path[:1], path[-1:])
        assert kept == path or len(kept) >= 50


def thoughts(detections: int, characters: int = 1_000) -> Land:
    corners = ((0.1234567890123, -1e-17),) * 32
    seen = Detection(
        marker_id=0, confidence=0.5, position_m=(0.1, -0.2e-99, 0.3), corners_px=corners
    )
    path = ((0.1234567890123456, 1.0, 2.0),) * 100
    return told(
        detections=(seen,) * detections, planned_path_m=path, note="\U0001f6ec" * characters
    )


def fill(room: Room, steps: list[dict[str, Any]]) -> None:
    while True:
        command = read_command(thoughts(100), room)
        assert command.diagnostics
        steps.append(dataclasses.asdict(command.diagnostics))


def test_flood_of_diagnostics_is_recorded_in_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnostics, "MOST_BYTES", 2_400_000)
    steps: list[dict[str, Any]] = []
    with pytest.raises(NonsenseError, match="fill more than 2400000 bytes") as refused:
        fill(Room(), steps)
    assert refused.value.error == "BadDiagnostics"
    assert steps[0]["note"]
    assert not steps[-1]["note"]
    assert len(steps[-1]["detections"]) == 100
    assert len(json.dumps(steps)) < 2_400_000


def test_what_verdicts_need_is_recorded_at_the_highest_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A tenth of the longest flight at 240 Hz in a tenth of the room."""
    monkeypatch.setattr(diagnostics, "MOST_BYTES", diagnostics.MOST_BYTES // 10)
    room = Room()
    for _ in range(12 * 240):
        command = read_command(thoughts(2, characters=60), room)
    assert command.diagnostics
    assert len(command.diagnostics.detections) == 2


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


class BadText(Exception):  # noqa: N818 (as users name theirs)
    def __str__(self) -> str:
        raise RuntimeError("no text")


class BadNotes(Exception):  # noqa: N818
    __notes__ = property(lambda self: 1 / 0)


class Leaves(BaseException):
    pass


LongName = type("L" * 400 + "/..", (Exception,), {})


@pytest.mark.parametrize(
    ("error", "name", "words"),
    [
        (BadText(), "BadText", "whose str() raised RuntimeError"),
        (BadNotes("notes"), "BadNotes", "notes"),
        (ValueError("x" * 50_000_000), "ValueError", "... (cut, 50000000 characters)"),
        (LongName("long"), "L" * 80, "long"),
        (SystemExit(3), "SystemExit", "3"),
        (Leaves("without a word"), "Leaves", "without a word"),
        (ValueError(f"no plan for {object()}"), "ValueError", "object at 0x...>"),
        (ValueError("\ud800 \x1b[2J"), "ValueError", "\\ud800"),
        (ExceptionGroup("many", [ValueError("a")] * 3), "ExceptionGroup", "many"),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else "",
)
def test_whatever_is_raised_becomes_a_record_of_bounded_size(
    error: BaseException, name: str, words: str, tmp_path: Path
) -> None:
    def answer() -> Any:
        raise error

    crash = flight_with(answer).crash
    assert crash.kind == "raised"
    assert crash.error == name
    assert words in crash.message
    assert "in answer" in crash.traceback or name == "BadNotes"
    assert len(json.dumps(dataclasses.asdict(crash))) < 60_000
    assert len(judge(flight_with(answer), Limits()).story) < 700
    (tmp_path / f"case-{crash.error}.toml").write_text(crash.message, encoding="utf-8")


def test_endless_recursion_is_a_finding() -> None:
    def answer() -> Any:
        return answer()

    crash = flight_with(answer).crash
    assert crash.error == "RecursionError"
    assert len(crash.traceback) < 30_000


def test_ctrl_c_of_the_user_passes() -> None:
    def answer() -> Any:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        flight_with(answer)


def test_sigterm_during_a_call_passes() -> None:
    from pytest_garl.cli import _exit

    before = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(SystemExit, match="143"):
            flight_with(lambda: _exit(signal.SIGTERM, None))
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("name", ["needs_camera", "observe_truth", "control", "step"])
def test_property_that_raises_is_a_finding(name: str) -> None:
    def fail(self: object) -> Any:
        raise RuntimeError(f"no {name}")

    space = {name: property(fail), "airframe": Airframe(control_rate_hz=240)}
    flight = flight_of(type("Fails", (Scripted,), {"step": lambda self, _: Land()} | space))
    assert flight.crash.error == "RuntimeError"
    assert flight.crash.message == f"no {name}"


def test_truth_value_that_raises_is_a_finding() -> None:
    class Unsure:
        def __bool__(self) -> bool:
            raise RuntimeError("neither")

    system = type("Fails", (Scripted,), {"step": lambda *_: Land(), "needs_camera": Unsure()})
    assert flight_of(system).crash.message == "neither"


class Meta(type):
    @property
    def airframe(cls) -> Airframe:
        raise RuntimeError("no airframe")


class Heavy(Airframe):
    def __getattribute__(self, name: str) -> Any:
        return -1.0 if name == "mass_kg" else super().__getattribute__(name)


@pytest.mark.parametrize(
    ("airframe", "words"),
    [
        ("big", "airframe is 'big'; expected pytest_garl.Airframe"),
        (property(lambda self: 1 / 0), "airframe is a property"),
        (Airframe, "airframe is <class"),
    ],
)
def test_wrong_airframe_is_a_finding_not_silently_the_default(airframe: Any, words: str) -> None:
    system = type("Odd", (Scripted,), {"airframe": airframe, "step": lambda *_: Land()})
    flight = flight_of(system)
    assert (flight.crash.kind, flight.crash.error) == ("nonsense", "BadAirframe")
    assert words in flight.crash.message
    assert flight.crash.where == "Odd.airframe"
    with pytest.raises(LandingSystemError, match=words):
        airframe_of(system)


def test_airframe_of_a_class_that_raises_is_a_finding() -> None:
    system = Meta("Odd", (), {"reset": lambda *_: None, "step": lambda *_: Land()})
    assert flight_of(system).crash.message == "no airframe"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Airframe(mass_kg=-1), "mass_kg = -1; expected a number from 0.1 to 100 kg"),
        (lambda: Airframe(mass_kg=NAN), "mass_kg = nan"),
        (lambda: Airframe(mass_kg=HUGE), "mass_kg = 1000"),
        (lambda: Airframe(size_m=0), "size_m = 0"),
        (lambda: Airframe(latency_s=NAN), "latency_s = nan"),
        (lambda: Airframe(latency_s=-0.1), "latency_s = -0.1"),
        (lambda: Airframe(control_rate_hz=0), "control_rate_hz = 0"),
        (lambda: Airframe(control_rate_hz="fast"), "control_rate_hz = 'fast'"),  # type: ignore[arg-type]
        (lambda: Airframe(camera=None), "camera is of type NoneType"),  # type: ignore[arg-type]
        (lambda: Camera(rate_hz=0), "rate_hz = 0; expected a number from 0.1 to 240 Hz"),
        (lambda: Camera(width_px=0, height_px=0), "width_px = 0; expected a whole number"),
        (lambda: Camera(width_px=320.5), "width_px = 320.5"),  # type: ignore[arg-type]
        (lambda: Camera(width_px=200_000, height_px=200_000), "at most 8294400 pixels"),
        (lambda: Camera(field_of_view_rad=3.5), "field_of_view_rad = 3.5"),
        (lambda: Camera(field_of_view_rad=np.zeros(2)), "field_of_view_rad"),  # type: ignore[arg-type]
        (lambda: Heavy(), "mass_kg"),
    ],
)
def test_impossible_airframe_is_refused_where_it_is_made(
    make: Callable[[], Any], words: str
) -> None:
    with pytest.raises(LandingSystemError) as refused:
        make()
    assert words in str(refused.value)


def test_airframe_of_the_least_and_the_most_can_be_flown() -> None:
    for airframe in (
        Airframe(mass_kg=0.1, size_m=0.1, latency_s=5.0, camera=Camera(width_px=16, height_px=16)),
        Airframe(mass_kg=100.0, size_m=5.0, camera=Camera(field_of_view_rad=3.0, rate_hz=240.0)),
        Airframe(camera=Camera(field_of_view_rad=0.05, rate_hz=0.1)),
    ):
        system = type(
            "Odd",
            (Scripted,),
            {"airframe": airframe, "needs_camera": True, "step": lambda self, _: self.hover(2.0)},
        )
        flight = flight_of(system, 0.5)
        assert flight.outcome in ("not_landed", "collision"), flight.crash
        assert np.isfinite(flight.uav.position_m).all()


class Turns(Scripted):
    """Turns its nose, then gives the landing to the flight control."""

    last: Command

    def step(self, observation: Observation) -> Command:
        if observation.time_s < 4:
            return dataclasses.replace(self.hover(3.0), yaw_rad=1.0)
        return self.last


@pytest.mark.parametrize("last", [Land(), Abort()])
def test_landing_and_aborting_keep_the_yaw(last: Command) -> None:
    flight = flight_of(type("Turns", (Turns,), {"last": last}), 8)
    x, y, z, w = flight.uav.attitude[-1]
    assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(1.0, abs=0.05)


def test_abort_keeps_the_yaw_that_a_system_with_its_own_control_was_flying() -> None:
    from pytest_garl.simulation.physics.flight_control import FlightControl
    from pytest_garl.simulation.physics.vehicle import Motion, vehicle_model

    control = FlightControl(vehicle_model(Airframe()))
    half = math.sin(0.5), math.cos(0.5)
    turned = Motion((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 0.0, *half), (0.0, 0.0, 0.0))
    control.take(PositionSetpoint(position_m=(0.0, 0.0, 5.0), yaw_rad=1.0))
    control.take(Abort())
    fl, fr, rr, rl = control.thrusts(turned, Abort(), 1 / 240)
    assert fl + rr == pytest.approx(fr + rl)


class StopsThinking(Scripted):
    def reset(self, mission: Any) -> None:
        super().reset(mission)
        self.over = False

    def step(self, observation: Observation) -> Command:
        assert not self.over
        self.over = observation.time_s >= 3
        return Abort() if self.over else self.hover(3.0)


def test_step_is_not_called_after_abort() -> None:
    flight = flight_of(StopsThinking, 20)
    assert (flight.outcome, flight.crash) == ("aborted", None)
    times = [step.time_s for step in flight.steps]
    assert times[-1] > 4
    assert {step.command for step in flight.steps if step.time_s >= 3} == {"Abort"}


def test_observation_cannot_be_made_writeable_again() -> None:
    class Unlocks(Scripted):
        def step(self, observation: Observation) -> Command:
            observation.depth_m.flags.writeable = True
            return self.hover(2.0)

    crash = flight_of(Unlocks).crash
    assert crash.error == "ValueError"
    assert "WRITEABLE" in crash.message


def test_physics_without_finite_numbers_end_the_flight_as_a_finding(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from pytest_garl.simulation.physics.world import World

    where, step = World.uav, World.step
    steps = itertools.count()
    broken: list[int] = []

    def steps_on(self: World, *forces: Any) -> None:
        step(self, *forces)
        broken.extend([1] if next(steps) > 100 else [])

    def nowhere(self: World) -> Any:
        position, *rest = where(self)
        return ((NAN, *position[1:]) if broken else position), *rest

    monkeypatch.setattr(World, "step", steps_on)
    monkeypatch.setattr(World, "uav", nowhere)
    flight = flight_with(lambda: Land())
    assert (flight.crash.kind, flight.crash.error) == ("nonsense", "NotFinite")
    save(flight, tmp_path / "flight.npz")


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
