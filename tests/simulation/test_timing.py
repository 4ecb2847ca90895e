"""Late, uneven and lost frames, wrong stamps, and events: what reaches the landing system when."""

from __future__ import annotations

import itertools
import math
from typing import ClassVar

import numpy as np
import pytest

from pytest_garl import Airframe, Command, Mission, MotorThrusts, Observation, VehicleState
from pytest_garl.flight.flight import Flight
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, Hovers, Scripted, nominal

pytestmark = pytest.mark.sim


class Climbs(Scripted):
    """Climbs, and keeps what it is told."""

    seen: ClassVar[list[Observation]] = []

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.seen.clear()

    def step(self, observation: Observation) -> Command:
        self.seen.append(observation)
        return self.hover(40.0)


class Looks(Climbs):
    needs_camera = True
    pictures: ClassVar[list[tuple[float, float, float]]] = []

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.pictures.clear()

    def step(self, observation: Observation) -> Command:
        image, depth = observation.image, observation.depth_m
        self.pictures.append((observation.time_s, float(image.mean()), float(depth.mean())))
        return self.hover(4.0)


def flown(seconds: float, system: type = Climbs, **conditions: float) -> Flight:
    return fly(nominal(**conditions), system, STAND, map=EMPTY, time_limit_s=seconds)


def called_s(flight: Flight) -> list[float]:
    return [step.time_s for step in flight.steps]


def stamps_s() -> list[float]:
    return [each.time_s for each in Climbs.seen]


def test_latency_delays_each_call_and_keeps_the_stamp() -> None:
    flight = flown(2.0, timing__latency_ms=200.0)
    assert called_s(flight) == pytest.approx([0.2 + 0.1 * index for index in range(18)])
    assert stamps_s() == pytest.approx([0.1 * index for index in range(18)])


def test_jitter_stays_in_its_range_and_frames_in_order() -> None:
    flight = flown(8.0, timing__jitter_ms=300.0)
    delays = np.subtract(called_s(flight), stamps_s())
    assert delays.min() >= 0
    assert 0.2 < delays.max() <= 0.3
    assert np.std(delays) > 0.05
    assert called_s(flight) == sorted(called_s(flight))
    assert stamps_s() == sorted(set(stamps_s()))


def test_a_dropped_frame_is_not_shown() -> None:
    flown(30.0, timing__dropped_percent=40.0)
    frames = 300
    # Four standard deviations of a binomial distribution.
    assert len(Climbs.seen) == pytest.approx(0.6 * frames, abs=4 * math.sqrt(0.24 * frames))
    dropped = stamps_s()
    flown(30.0, timing__dropped_percent=40.0, timing__jitter_ms=50.0)
    assert stamps_s() == dropped[: len(stamps_s())]


@pytest.mark.parametrize("error_ms", [-100.0, 100.0])
def test_a_stamp_error_separates_the_pose_from_the_picture(error_ms: float) -> None:
    flight = flown(3.0, timing__stamp_error_ms=error_ms)
    climbing = [step for step in flight.steps if step.time_s > 2]
    speed = float(flight.uav.velocity_mps[flight.uav.time_s > 2, 2].mean())
    told = [step.estimation_error_m[2] for step in climbing]
    assert speed > 2
    assert np.mean(told) == pytest.approx(speed * error_ms / 1000, abs=0.03)
    assert min(np.diff(stamps_s())) > 0.09
    assert stamps_s()[0] == pytest.approx(max(0.0, error_ms / 1000))


def test_a_burst_delays_the_frames_that_are_taken_in_it() -> None:
    flight = flown(4.0, burst__from_s=1.0, burst__lasts_s=0.5, burst__latency_ms=1000.0)
    delay = dict(zip([round(each, 2) for each in stamps_s()], called_s(flight), strict=True))
    assert delay[0.9] == pytest.approx(0.9)
    assert delay[1.0] == pytest.approx(2.0)
    assert delay[1.4] == pytest.approx(2.4)
    # Frames after the burst wait for those before them.
    assert delay[1.5] == pytest.approx(2.4)
    assert delay[2.5] == pytest.approx(2.5)


def test_a_camera_that_fails_shows_black_and_no_depth() -> None:
    flight = flown(4.0, Looks, outage__from_s=2.0, outage__lasts_s=1.0)
    during = [item for item in Looks.pictures if 2.0 <= item[0] < 3.0 - 1e-6]
    assert len(during) == 10
    assert {item[1:] for item in during} == {(0.0, 0.0)}
    assert all(item[1] > 0 for item in Looks.pictures if not 2.0 <= item[0] < 3.0 - 1e-6)
    assert all(step.marker is None for step in flight.steps if 2.0 <= step.time_s < 2.95)


def test_a_frozen_camera_repeats_its_last_picture() -> None:
    flown(4.0, Looks, outage__from_s=2.0, outage__lasts_s=1.0, outage__frozen=1.0)
    values = {round(item[0], 1): item[1:] for item in Looks.pictures}
    assert values[2.0] == values[2.5] == values[2.9] == values[1.9]
    assert values[1.8] != values[1.9] != values[3.0]


def test_an_outage_of_a_whole_flight_leaves_nothing_to_see() -> None:
    hidden = flown(5.0, Hovers, outage__lasts_s=60.0)
    assert hidden.outcome == "not_landed"
    assert not hidden.nominal_views
    assert flown(5.0, Hovers).nominal_views


def test_the_same_scenario_has_the_same_delays() -> None:
    first, again = (
        called_s(flown(5.0, timing__jitter_ms=80.0, timing__dropped_percent=30.0)) for _ in range(2)
    )
    assert first == again


class FliesItsMotors(Scripted):
    airframe = Airframe(control_rate_hz=240)
    calls: ClassVar[list[str]] = []

    def reset(self, mission: Mission) -> None:
        self.calls.clear()

    def step(self, observation: Observation) -> Command:
        self.calls.append("step")
        return self.hover_nowhere()

    def hover_nowhere(self) -> Command:
        from pytest_garl import Land

        return Land()

    def control(self, state: VehicleState) -> MotorThrusts:
        self.calls.append("control")
        return MotorThrusts(newtons=(0.0, 0.0, 0.0, 0.0))


def test_control_waits_for_the_first_step() -> None:
    flown(1.0, FliesItsMotors, timing__latency_ms=300.0)
    assert FliesItsMotors.calls[0] == "step"
    steps = [index for index, call in enumerate(FliesItsMotors.calls) if call == "step"]
    assert [b - a for a, b in itertools.pairwise(steps)] == [25] * (len(steps) - 1)


def yaw_deg(flight: Flight, index: int) -> float:
    _, _, z, w = flight.uav.attitude[index]
    return math.degrees(2 * math.atan2(z, w))


class KeepsItsHeading(Scripted):
    def step(self, observation: Observation) -> Command:
        import dataclasses

        return dataclasses.replace(self.hover(3.0), yaw_rad=None)


@pytest.mark.parametrize(("system", "at_the_end"), [(Hovers, 0.0), (KeepsItsHeading, 120.0)])
def test_a_heading_is_that_of_the_start(system: type, at_the_end: float) -> None:
    flight = flown(6.0, system, heading__start_deg=120.0)
    assert yaw_deg(flight, 0) == pytest.approx(120.0)
    assert yaw_deg(flight, -1) == pytest.approx(at_the_end, abs=1.0)
