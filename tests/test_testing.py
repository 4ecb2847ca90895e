from __future__ import annotations

import contextlib
import dataclasses
import itertools
import math
import re
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl import (
    Abort,
    Airframe,
    Command,
    Diagnostics,
    Land,
    Limits,
    MarkerSpec,
    Mission,
    Observation,
    PositionSetpoint,
    Start,
    VelocitySetpoint,
    testing,
)
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution import metering
from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.execution.judge_process import JudgeProcess
from pytest_garl.external.external_program import ExternalProgram
from pytest_garl.search import probes
from pytest_garl.simulation.system_under_test.ground_truth import Truth
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from pytest_garl.testing import check_landing_system
from tests.external.programs import RISES, written
from tests.support.probed_landers import ZeroByDefault

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


class RemembersTheMarker(Climbs):
    """Lands at the told coordinate once; then it flies to that of the flight before."""

    known: tuple[float, float] | None = None

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.known = self.known or mission.gps_position_m

    def step(self, observation: Observation) -> Command:
        assert self.known
        if observation.time_s < 20:
            return PositionSetpoint(position_m=(*self.known, 5.0))
        return Land()


class AsksForTheTruth(Climbs):
    def observe_truth(self, truth: Truth) -> None:
        raise AssertionError("told")


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


class NotANumber(Climbs):
    def step(self, observation: Observation) -> Command:
        if observation.time_s < 3:
            return super().step(observation)
        diagnostics = Diagnostics(phase="outward")
        if observation.time_s > 3.05:
            velocity = (math.nan, 0.0, 0.0)
            return VelocitySetpoint(velocity_mps=velocity, diagnostics=diagnostics)
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, 0.0), diagnostics=diagnostics)


class Misspelled(Climbs):
    def step(self, observation: Any) -> Command:
        return PositionSetpoint(position_m=observation.position)


class Degrees(Climbs):
    def step(self, observation: Observation) -> Command:
        yaw = 90 if observation.time_s > 2 else 0
        return PositionSetpoint(position_m=(0.0, -16.5, 3.0), yaw_rad=yaw)


class TurnsOnce(Climbs):
    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=(0.0, -16.5, 3.0), yaw_rad=-2 * math.pi)


class Asynchronous(Climbs):
    async def step(self, observation: Observation) -> Command:  # type: ignore[override]
        return super().step(observation)


class TellsItsMission(Climbs):
    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        marker = mission.marker_dictionary, mission.marker_id, mission.marker_side_m
        TOLD.append((*marker, mission.home_m[2]))

    def step(self, observation: Observation) -> Command:
        return Abort()


TOLD: list[tuple[str, int, float, float]] = []


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
    assert check.passed
    (warning,) = check.warnings
    assert warning.startswith("returns no diagnostics: reports cannot say what it saw or intended")
    assert all(f"{name}=" in warning for name in ("target_m", "detections", "phase"))
    # A flight until the time is up costs more than one that lands.
    assert check.longest_cpu_s > 3 * check.cpu_s
    low, high = re.findall(r"a search of 40 flights on a map takes (\d+) to (\d+) s", str(check))[0]
    assert int(high) > 3 * int(low)


def test_check_refuses_a_class_that_asks_for_the_truth() -> None:
    with pytest.raises(LandingSystemError, match="has an attribute observe_truth, the name by"):
        check_landing_system(AsksForTheTruth)


def test_check_finds_a_flight_that_depends_on_the_one_before() -> None:
    with pytest.raises(LandingSystemError, match="must forget the flight before, first at"):
        check_landing_system(RemembersTheMarker)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (
            GivesUp,
            [
                "moving objects: it gave up at 2.1 s, ",
                " m up and 16.5 m from the marker. ",
                "Gave up at",
                "gave up in both",
                "no diagnostics",
            ],
        ),
        (
            LandsAtHome,
            [
                "objects: it landed 16.5 m off the marker, on open ground. It never looked",
                "never name a detection",
            ],
        ),
        (
            Climbs,
            [
                "objects: it never commanded a landing; from ",
                " s to the end at 25 s it hovered 2.8 m up and 16.5 m from the marker. ",
                "It never looked at a picture.",
            ],
        ),
        (
            StandsOnItsFeet,
            ["it stood on the ground, 16.5 m off", "touched the ground, but its motors did not"],
        ),
        (Skids, ["and slid on"]),
    ],
)
def test_check_says_that_a_system_does_not_land_in_clear_air(
    system: type, words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(testing, "time_limit_s", lambda limits: 25.0)
    check = check_landing_system(system)
    (fault,) = check.faults
    assert not check.passed
    assert fault.startswith("your system does not land in clear air, on lawn")
    for each in words:
        assert each in str(check), str(check)


def test_check_shows_what_a_program_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program that prints and stays on the ground, and one that ends with an error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(testing, "time_limit_s", lambda limits: 3.0)
    monkeypatch.setattr(ExternalProgram, "check_place", lambda program: None)
    prints = "sys.stderr.write(''.join(f'line {n}\\n' for n in range(99)))"
    text = RISES.replace("import garl_client", "import sys, garl_client").replace("2.0", "0.0")
    (fault,) = check_landing_system(written(tmp_path, text.format(misbehaves=prints))).faults
    assert "it never commanded a landing; it never left the ground. It never looked" in fault
    shown = [line.strip() for line in fault.splitlines()]
    assert "line 98" in shown
    assert "line 0" not in shown
    assert shown[-1] == "All that it printed: .garl/check/lander-lawn.log"
    kept = Path(".garl/check/lander-lawn.log").read_text().splitlines()
    assert kept == [f"line {n}" for n in range(99)]
    ends = written(tmp_path, text.format(misbehaves="print('bye', file=sys.stderr); sys.exit(3)"))
    with pytest.raises(LandingSystemError) as raised:
        check_landing_system(ends)
    assert str(raised.value).endswith("\nbye\nAll that it printed: .garl/check/lander-lawn.log")


def test_a_flight_that_ends_early_is_no_fault() -> None:
    assert check_landing_system(Climbs, seconds=2).passed


def test_check_says_when_and_where_a_command_is_nonsense() -> None:
    with pytest.raises(LandingSystemError) as raised:
        check_landing_system(NotANumber)
    text = str(raised.value)
    assert "NotANumber.step: at 3.1 s, in the phase take-off, 2." in text
    assert "m up and 16.5 m from the marker; its own phase was 'outward'" in text
    assert "velocity_mps = (nan, 0.0, 0.0); expected 3 finite numbers" in text


def test_check_says_that_nothing_was_commanded_before_an_error() -> None:
    with pytest.raises(LandingSystemError, match="before its first command: AttributeError"):
        check_landing_system(Misspelled)


def test_check_names_the_field_that_was_meant() -> None:
    with pytest.raises(LandingSystemError) as raised:
        check_landing_system(Misspelled)
    assert "Observation has no 'position'; did you mean position_m?" in str(raised.value)
    assert "Lazy" not in str(raised.value)


def test_check_refuses_a_yaw_in_degrees() -> None:
    words = r"at 2\.\d s, in the phase .* returned yaw_rad = 90; expected radians .* degrees\?"
    with pytest.raises(LandingSystemError, match=words):
        check_landing_system(Degrees, seconds=4)


def test_check_accepts_a_full_turn() -> None:
    assert check_landing_system(TurnsOnce, seconds=2).passed


def test_check_refuses_a_coroutine() -> None:
    with pytest.raises(LandingSystemError, match=r"Asynchronous\.step is `async def`; expected a"):
        check_landing_system(Asynchronous)


def test_check_flies_the_marker_the_start_and_the_limits_that_are_given() -> None:
    check = check_landing_system(
        TellsItsMission,
        seconds=1,
        marker=MarkerSpec(dictionary="DICT_4X4_50", id=7, side_m=0.4),
        start=Start(mode="hover", height_m=5.0),
        domain="calm",
        limits=Limits(abort="ok"),
    )
    assert TOLD[0] == ("DICT_4X4_50", 7, 0.4, 5.0)
    assert any("Gave up" in text for text in check.flights)


def test_check_of_a_nondeterministic_system_may_only_warn() -> None:
    check = check_landing_system(Whimsical, seconds=2, deterministic=False)
    assert any("two flights of the same scenario differ" in text for text in check.warnings)
    assert any("warning: Whimsical: two flights" in line for line in str(check).splitlines())


def test_check_stops_when_its_computing_time_is_used_up() -> None:
    check = check_landing_system(Climbs, limit_s=0.0)
    assert check.flights == ()
    assert "stopped after 0 s of computing" in check.warnings[0]


def test_check_compares_a_slow_system_over_shorter_flights() -> None:
    plan = dataclasses.replace(testing.plan_for(map="lawn"), seconds=20.0, limit_s=10.0)
    calm = testing._Checker(Climbs, plan)
    first = calm._fly(Climbs, calm._calm, 20.0)
    other, seconds = calm._compare(first._replace(cpu_s=5.0))
    assert 2.0 <= other.flight.elapsed_s < 5.0
    unused: Any = None
    ending = calm._ending(other.flight, unused, seconds)
    assert ending.startswith(f"cut off after {seconds:.3g} s (so that the check ends in time), ")


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


def test_check_flies_probes_of_a_system_that_lands(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = testing.plan_for(map="lawn", start=Start(mode="hover", height_m=6.0))
    checker = testing._Checker(ZeroByDefault, dataclasses.replace(plan, probes=True))
    made = probes.probes_for

    def two(*args: Any) -> Any:
        return [each for each in made(*args) if each.name in ("no-marker", "start-over")]

    monkeypatch.setattr(testing, "probes_for", two)
    calm = checker._fly(ZeroByDefault, checker._calm, 120.0)
    with JudgeProcess() as judge:
        checker._probe(judge, calm.flight)
    beside, without = checker._probed
    assert (beside.name, beside.passed) == ("start-beside", True)
    assert str(without) == (
        "probe no-marker: FAILED: no marker is there for a minute: landed 4.0 m off the marker, on "
        "open ground"
    )
    check = testing.Check(system="S", flights=(), warnings=(), cpu_s=1.0, probes=(beside, without))
    assert not check.passed
    assert "S: probe no-marker: FAILED" in str(check)


def test_check_flies_no_probes_of_a_system_that_does_not_land() -> None:
    plan = testing.plan_for(map="lawn")
    checker = testing._Checker(Climbs, dataclasses.replace(plan, probes=True))
    calm = checker._fly(Climbs, checker._calm, 25.0)
    judge = JudgeProcess()
    checker._note_result(calm, judged(calm.flight, plan.limits))
    checker._probe(judge, calm.flight)
    assert checker._probed == []


def test_what_the_computing_time_leaves_unflown_is_named() -> None:
    plan = testing.plan_for(map="lawn")
    short = testing._Checker(Climbs, dataclasses.replace(plan, probes=True, limit_s=0.01)).run()
    (text,) = (each for each in short.warnings if each.startswith("stopped"))
    assert text == (
        "stopped after 0.01 s of computing; not flown: clear air, another scenario and both again, "
        "the probes"
    )
    assert str(short).startswith(
        "Climbs: lawn: the marker is DICT_5X5_50 id 0, 1.5 m wide; the camera has 320x240 pixels, "
        "10 Hz, 90 degrees from left to right\n"
    )


def test_a_violated_probe_outside_the_domain_is_a_note() -> None:
    probe = testing.ProbeResult(
        name="level-wind", sentence="wind", ending="slid", violated=True, outside=("wind = 5",)
    )
    assert probe.passed
    assert str(probe) == "probe level-wind: note: wind: slid (outside the domain: wind = 5)"
