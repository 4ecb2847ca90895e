"""One flight is flown, judged and saved; one with a NaN is a finding without a record."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.fly_and_judge import fly_job, judged, measured, time_limit_s
from pytest_garl.execution.reference import reference_to
from pytest_garl.flight.flight import Flight, Step
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import Command, Diagnostics, Land, Observation, PositionSetpoint
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.groups import EVENT_MOMENTS
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.verdict import Limits
from tests.execution.flying import LAWN, Good, job_of, scenario
from tests.support import tiny_simulator
from tests.support.bent_judges import LandsAtHome
from tests.verdicts.flights import flight, hit

NAN = math.nan


def with_nan_distance(*args: Any, **more: Any) -> Flight:
    return dataclasses.replace(tiny_simulator.fly(*args, **more), final_distance_m=NAN)


def with_nan_track(*args: Any, **more: Any) -> Flight:
    flight = tiny_simulator.fly(*args, **more)
    flight.uav.position_m[-1, 2] = math.inf
    return flight


def with_nan_target(*args: Any, **more: Any) -> Flight:
    step = Step(
        time_s=1.0,
        command="Land",
        marker_visible=1.0,
        marker_px=1.0,
        objects_visible=(),
        diagnostics=Diagnostics(target_m=(NAN, 0.0, 0.0)),
    )
    return dataclasses.replace(tiny_simulator.fly(*args, **more), steps=(step,))


@pytest.mark.parametrize(
    ("simulator", "words"),
    [
        (with_nan_distance, "final_distance_m"),
        (with_nan_track, "0.position_m"),
        (with_nan_target, "steps"),
    ],
)
def test_flight_that_is_not_finite_is_a_finding(
    simulator: Callable[..., Flight], words: str, tmp_path: Path
) -> None:
    job = dataclasses.replace(job_of(Good, tmp_path), simulator=reference_to(simulator))
    result, sha256, _ = fly_job(job, scenario(), FlightId(search="search", map="lawn"), None)
    assert result.outcome == "crashed"
    assert result.signature == "V:nonsense:NotFinite"
    assert f"holds a NaN or an infinity in {words}" in result.verdict.story
    result.dumps()
    assert (sha256, list(tmp_path.iterdir())) == ("", [])


def test_flight_ends_at_the_limit_of_the_paper_or_later() -> None:
    assert time_limit_s(Limits(time_s=20.0)) == 120.0
    assert time_limit_s(Limits(time_s=200.0)) == 200.0


def test_flight_is_judged_and_its_record_saved(tmp_path: Path) -> None:
    job, flight = job_of(Good, tmp_path), FlightId(search="search", map="lawn")
    result, sha256, wall_s = fly_job(job, scenario(), flight, None)
    record = load(job.record(flight))
    assert result == judged(record, job.limits)
    assert (result.outcome, result.signature, result.crash) == ("landed", "", None)
    assert (record.sha256, record.wall_s) == (sha256, wall_s)


def with_decision(*args: Any, **more: Any) -> Flight:
    moments = (("start", 0.0), ("8 m", 2.0), ("3 m", 4.0), ("decided cover", 4.5))
    return dataclasses.replace(tiny_simulator.fly(*args, **more), moments=moments)


def test_what_a_violation_took_names_the_moment_at_which_an_event_struck(tmp_path: Path) -> None:
    decided = float(EVENT_MOMENTS.index("decided"))
    waits = scenario().replace({"cover.after": decided, "cover.lasts_s": 2.0})
    job = dataclasses.replace(
        job_of(Good, tmp_path), simulator=reference_to(with_decision), limits=Limits(time_s=0.001)
    )
    result, _, _ = fly_job(job, waits, FlightId(search="search", map="lawn"), None)
    assert dict(result.decided) == {"cover.after": EVENT_MOMENTS.index("3 m"), "cover.from_s": 0.5}
    assert result.severity is not None
    assert "0.5 s after the UAV passes 3 m, lasts 2 s" in result.severity.values


def test_flight_removes_the_record_of_an_earlier_attempt(tmp_path: Path) -> None:
    job, flight = job_of(Good, tmp_path), FlightId(search="search", map="lawn")
    fly_job(job, scenario(), flight, None)
    broken = dataclasses.replace(job, simulator=reference_to(with_nan_distance))
    fly_job(broken, scenario(), flight, None)
    assert not job.record(flight).exists()


def test_a_soft_touchdown_before_a_collision_is_none() -> None:
    (ground,), (dog,) = hit("ground", "ground", "ground"), hit("dog-1", "dog", "dynamic")
    met = judged(flight("collision", (0.0, 0.0, 0.2), contacts=(ground, dog)), Limits())
    assert met.collisions == ("dog-1",)
    first = dataclasses.replace(ground, time_s=20.0)
    hard = judged(flight("collision", (0.0, 0.0, 0.2), contacts=(first, ground)), Limits())
    assert hard.collisions == ("ground",)


@pytest.mark.sim
@pytest.mark.parametrize("lands_s", [3.0, 10.0])
def test_distances_are_measured_to_the_byte(lands_s: float) -> None:
    class Lands(LandsAtHome):
        needs_camera = False

        def step(self, observation: Observation) -> Command:
            # The second one takes off again in between.
            up = observation.time_s < 3.0 or 5.9 < observation.time_s < lands_s
            home = (self.home[0] + 0.1, self.home[1], 2.5)
            return PositionSetpoint(position_m=home) if up else Land(speed_mps=1.0)

    flown = fly(scenario(), Lands, policy_spec("stationary"), map=LAWN, time_limit_s=20.0)
    again = measured(flown)
    assert flown.touchdown is not None
    assert bool(flown.earlier_touchdowns) == (lands_s == 10.0)
    assert again.final_distance_m == flown.final_distance_m > 1.0
    assert again.touchdown == flown.touchdown
    assert again.earlier_touchdowns == flown.earlier_touchdowns
