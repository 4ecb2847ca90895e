from __future__ import annotations

import contextlib
import itertools
import subprocess
import threading
import time
from typing import Any

import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl import (
    Abort,
    Airframe,
    Command,
    Diagnostics,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
    testing,
)
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution import metering
from pytest_garl.simulation.system_under_test.ground_truth import Truth
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from pytest_garl.testing import check_landing_system

COUNTER = itertools.count()


class Climbs:
    needs_camera = False

    def reset(self, mission: Mission) -> None:
        self.height = 3.0

    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=(0.0, -16.5, self.height))


class NoReset:
    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=(0.0, 0.0, 1.0))


class WrongAirframe(Climbs):
    airframe = "big"


class ControlsWithoutRate(Climbs):
    def control(self, state: Any) -> Any:
        return None


class RateWithoutControl(Climbs):
    airframe = Airframe(control_rate_hz=100)


class TakesTwo(Climbs):
    def step(self, observation: Observation, more: int) -> Command:  # type: ignore[override]
        return super().step(observation)


class Scribbles(Climbs):
    def step(self, observation: Observation) -> Command:
        observation.image[0, 0] = 0
        return super().step(observation)


class Whimsical(Climbs):
    def reset(self, mission: Mission) -> None:
        self.height = 2.0 + next(COUNTER)


class Remembers(Climbs):
    def __init__(self) -> None:
        self.height = 2.0

    def reset(self, mission: Mission) -> None:
        self.height += 1.0


class Silent(Climbs):
    def step(self, observation: Observation) -> Any:
        return None


class RemembersTheMarker(ReferencePilot):
    """Lands well once; then it flies to where the marker was in the flight before."""

    known: Truth | None = None

    def observe_truth(self, truth: Truth) -> None:
        self.known = self.known or truth
        super().observe_truth(self.known)


class GivesUp(Climbs):
    def step(self, observation: Observation) -> Command:
        return super().step(observation) if observation.time_s < 2 else Abort()


class LandsAtHome(Climbs):
    def step(self, observation: Observation) -> Command:
        there = observation.time_s > 4
        return Land(diagnostics=Diagnostics()) if there else super().step(observation)


class StandsOnItsFeet(Climbs):
    """Comes down to its feet, and hovers there."""

    def step(self, observation: Observation) -> Command:
        if observation.time_s < 4:
            return super().step(observation)
        return PositionSetpoint(position_m=(0.0, -16.5, 0.2))


class Skids(StandsOnItsFeet):
    def step(self, observation: Observation) -> Command:
        if observation.time_s < 4:
            return super().step(observation)
        return VelocitySetpoint(velocity_mps=(2.0, 0.0, -0.2))


class Sleeps(Climbs):
    def step(self, observation: Observation) -> Command:
        with contextlib.suppress(Exception):
            time.sleep(600)
        return super().step(observation)


class LeavesMuchBehind(Climbs):
    wait = threading.Event()

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        threading.Thread(target=self.wait.wait, name="my-thread", daemon=True).start()
        PROCESSES.append(subprocess.Popen(["sleep", "600"]))


PROCESSES: list[Any] = []


class Misnamed(Climbs):
    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=(0.0, 0.0, 2.0), speed_mps=-1.0)


@pytest.mark.parametrize("system", [Climbs, OpenCvLandingSystem])
def test_check_accepts_a_good_system(system: type) -> None:
    check_landing_system(system, seconds=2)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (NoReset, "has no method 'reset'"),
        (WrongAirframe, "airframe is 'big'"),
        (ControlsWithoutRate, "belong together"),
        (RateWithoutControl, "belong together"),
        (TakesTwo, "step: missing a required argument"),
        (Scribbles, "observations are read-only"),
        (Whimsical, "two flights of the same scenario differ, first at"),
        (Remembers, "reset\\(mission\\) must forget"),
        (Misnamed, "speed_mps = -1.0; expected 0 to 100 m/s"),
        (Silent, "step returned None"),
    ],
)
def test_check_names_each_fault(system: type, words: str) -> None:
    with pytest.raises(LandingSystemError, match=words):
        check_landing_system(system, seconds=2)


def test_check_refuses_a_class_inside_a_function() -> None:
    class Inner(Climbs):
        pass

    with pytest.raises(LandingSystemError, match="defined inside a function"):
        check_landing_system(Inner)


def test_check_flies_until_landed_and_reports_the_distance() -> None:
    check = check_landing_system(ReferencePilot)
    assert len(check.flights) == 2
    assert check.flights[0].startswith("lawn: landed 0.0")
    assert " m off after 2" in check.flights[0]
    (warning,) = check.warnings
    assert warning.startswith("returns no diagnostics: reports cannot say what it saw or intended")
    assert all(f"{name}=" in warning for name in ("target_m", "detections", "phase"))
    assert "ReferencePilot: a flight takes" in str(check)
    assert "40 flights take about" in str(check)


def test_check_finds_a_flight_that_depends_on_the_one_before() -> None:
    with pytest.raises(LandingSystemError, match="must forget the flight before, first at"):
        check_landing_system(RemembersTheMarker)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (GivesUp, ["gave up in a calm scenario", "gave up in both", "no diagnostics"]),
        (LandsAtHome, ["landed 16.5 m off", "never name a detection"]),
        (Climbs, ["did not land within 120 s"]),
        (StandsOnItsFeet, ["touched the ground, but its motors did not stop"]),
        (Skids, ["slid over the ground after its touchdown"]),
    ],
)
def test_check_warns_of_problems_of_a_search(system: type, words: list[str]) -> None:
    warnings = check_landing_system(system).warnings
    for each in words:
        assert any(each in warning for warning in warnings), warnings


def test_check_of_a_nondeterministic_system_may_only_warn() -> None:
    check = check_landing_system(Whimsical, seconds=2, deterministic=False)
    assert any("two flights of the same scenario differ" in text for text in check.warnings)
    assert any("warning: Whimsical: two flights" in line for line in str(check).splitlines())


def test_check_stops_when_its_computing_time_is_used_up() -> None:
    check = check_landing_system(Climbs, limit_s=0.0)
    assert check.flights == ()
    assert "stopped after 0 s of computing" in check.warnings[0]


def test_check_compares_a_slow_system_over_shorter_flights() -> None:
    calm = testing._Checker(Climbs, "lawn", 20.0, True, 10.0)
    first = calm._fly(Climbs, calm._calm, 20.0)
    other = calm._compare(first._replace(cpu_s=5.0))
    assert 2.0 <= other.flight.elapsed_s < 5.0


def test_check_ends_a_call_that_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metering, "HUNG_S", 0.1)
    with pytest.raises(LandingSystemError, match="one call took longer than"):
        check_landing_system(Sleeps)


def test_check_warns_of_slow_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(testing, "SLOW_CALL_S", 0.0)
    monkeypatch.setattr(testing, "SLOW_FLIGHT_S", 0.0)
    warnings = check_landing_system(Climbs, seconds=2).warnings
    assert any("--garl-timeout" in warning for warning in warnings)
    assert any("ms in each call" in warning for warning in warnings)


def test_check_warns_of_threads_and_processes_left_behind() -> None:
    try:
        warnings = check_landing_system(LeavesMuchBehind, seconds=2).warnings
    finally:
        LeavesMuchBehind.wait.set()
        for process in PROCESSES:
            process.kill()
            process.wait()
    assert "leaves 5 threads running (my-thread)" in warnings
    assert any("leaves 5 processes running" in warning for warning in warnings)
