from __future__ import annotations

import math
from dataclasses import replace

import pytest

from pytest_garl.vehicle import ArduPilotParameters
from pytest_garl.vehicle.landing_target import (
    AxisFilter,
    LandingTarget,
    measurement_variance,
)
from pytest_garl.vehicle.precision_landing import (
    Instruction,
    PrecisionLanding,
)

P = replace(ArduPilotParameters(), plnd_enabled=True)
PLACE = (1.0, -0.5)


def see(target: LandingTarget, start_s: float, seconds: float, height: float = 5.0) -> float:
    """Measure the target at 10 Hz; return the time of the last measurement."""
    time_s = start_s
    for step in range(round(seconds * 10) + 1):
        time_s = start_s + step / 10
        target.measure(PLACE, time_s, height, 0.0)
    return time_s


class Descent:
    """Runs the state machine at 20 Hz and does what it says, as a point without inertia."""

    def __init__(self, height: float, parameters: ArduPilotParameters = P) -> None:
        self.landing = PrecisionLanding(parameters)
        self.time_s, self.place, self.height = 0.0, (0.0, 0.0), height
        self.log: list[tuple[float, Instruction]] = []

    def run(self, seconds: float, *, seen: bool = False) -> list[str]:
        began = len(self.log)
        for step in range(round(seconds * 20)):
            self.time_s += 0.05
            if seen and step % 2 == 0:
                self.landing.target.measure(PLACE, self.time_s, self.height, 0.0)
            position = (*self.place, self.height)
            order = self.landing.update(self.time_s, position, self.height)
            self.log.append((self.time_s, order))
            self._obey(order)
        actions = [order.action for _, order in self.log[began:]]
        return [a for a, b in zip(actions, [None, *actions], strict=False) if a != b]

    def _obey(self, order: Instruction) -> None:
        if order.goal_m is not None:
            step = 2.0 * 0.05
            place = (*self.place, self.height)
            far = math.dist(order.goal_m, place)
            share = min(1.0, step / far) if far else 0.0
            x, y, self.height = (
                at + share * (to - at) for at, to in zip(place, order.goal_m, strict=True)
            )
            self.place = x, y
        elif order.action == "land on target":
            self.place = order.target_m or self.place
            self.height -= 0.5 * 0.05
        elif order.action == "descend":
            self.height -= 0.5 * 0.05


# The estimator


def test_the_variance_grows_with_height_and_turning() -> None:
    assert measurement_variance(0.0, 0.0) == pytest.approx(0.02**2)
    assert measurement_variance(8.0, 0.0) == pytest.approx(0.10**2)
    assert measurement_variance(8.0, 2.0) == pytest.approx(0.26**2)


def test_one_step_of_the_kalman_filter_is_as_worked_by_hand() -> None:
    # q = 20² / 400 = 1; P = [[1, 0], [0, 4]]; dt = 1.
    axis = AxisFilter(20.0, 0.0, 1.0)
    axis.predict(1.0)
    assert axis.variance == pytest.approx(1 + 4 + 1 / 3)
    # P01 = 4 + 1/2; S = 16/3 + 2/3 = 6; gains 8/9 and 3/4.
    assert axis.nis(3.0, 2 / 3) == pytest.approx(9 / 6)
    axis.fuse(3.0, 2 / 3)
    assert axis.position == pytest.approx(8 / 3)
    assert axis.velocity == pytest.approx(9 / 4)
    assert axis.variance == pytest.approx(16 / 3 / 9)


def test_a_target_counts_after_two_seconds_without_a_gap() -> None:
    target = LandingTarget(P)
    last = see(target, 0.0, 1.9)
    assert not target.found(last)
    see(target, last + 0.6, 1.9)  # a gap of 0.6 s: from the beginning
    assert not target.found(last + 2.5)
    last = see(target, last + 2.6, 0.2)
    assert target.found(last)
    assert target.place(last) == pytest.approx(PLACE, abs=1e-6)


def test_a_target_is_lost_after_two_seconds() -> None:
    target = LandingTarget(P)
    last = see(target, 0.0, 3.0)
    assert target.found(last + 1.9)
    assert not target.found(last + 2.1)


def test_an_outlier_is_refused_three_times_and_then_believed() -> None:
    target = LandingTarget(P)
    last = see(target, 0.0, 4.0)
    far = (PLACE[0] + 2.0, PLACE[1])
    answers = [target.measure(far, last + 0.1 * k, 5.0, 0.0) for k in range(1, 5)]
    assert answers == [False, False, False, True]
    assert target.place(last + 0.4)[0] > PLACE[0] + 0.1


def test_a_raw_target_counts_at_once_and_is_taken_as_it_is() -> None:
    target = LandingTarget(replace(P, plnd_est_type=0))
    target.measure((0.0, 0.0), 0.0, 5.0, 0.0)
    assert target.found(0.0)
    target.measure((4.0, 1.0), 0.1, 5.0, 0.0)
    assert target.place(0.1) == (4.0, 1.0)


def test_an_old_measurement_is_refused() -> None:
    target = LandingTarget(P)
    assert target.measure(PLACE, 1.0, 5.0, 0.0)
    assert not target.measure((9.0, 9.0), 0.9, 5.0, 0.0)


def test_a_place_that_was_never_measured_cannot_be_asked_for() -> None:
    with pytest.raises(ValueError, match="found"):
        LandingTarget(P).place(0.0)


# The state machine


def test_a_target_in_sight_is_landed_on() -> None:
    flight = Descent(9.0)
    flight.run(2.5, seen=True)
    assert flight.landing.status == "in sight"
    assert flight.run(3.0, seen=True) == ["land on target"]
    assert flight.place == pytest.approx(PLACE, abs=0.01)


@pytest.mark.parametrize("height", [8.5, 0.7, 0.0, -0.001])
def test_outside_its_heights_a_lost_target_does_not_matter(height: float) -> None:
    flight = Descent(height)
    assert flight.run(0.5) == ["descend"]


def test_a_strictness_of_0_lands_without_a_target() -> None:
    flight = Descent(6.0, replace(P, plnd_strict=0))
    assert flight.run(8.0) == ["descend"]
    flight = Descent(7.0, replace(P, plnd_strict=0))
    flight.run(4.0, seen=True)
    assert flight.run(8.0) == ["land on target", "descend"]
    assert flight.landing.status == "lost"


@pytest.mark.parametrize(("strict", "then"), [(1, ["hold", "descend"]), (2, ["hold"])])
def test_a_target_that_was_never_seen_fails_the_landing(strict: int, then: list[str]) -> None:
    flight = Descent(9.0, replace(P, plnd_strict=strict))
    assert flight.run(20.0) == ["descend", *then]
    held = [time_s for time_s, order in flight.log if order.action == "hold"]
    if strict == 1:
        assert held[-1] - held[0] == pytest.approx(7.0, abs=0.11)
    assert flight.log[round(held[0] * 20) - 1][1].action == "hold"


def test_a_lost_target_is_looked_for_from_above_the_last_sight() -> None:
    flight = Descent(6.0)
    flight.run(4.0, seen=True)
    lost_at, height = flight.time_s, flight.height
    assert flight.run(5.0) == ["land on target", "descend", "retry"]
    first = next((t, o) for t, o in flight.log if o.action == "retry")
    # PLND_TIMEOUT counts from the last measurement.
    assert first[0] - lost_at == pytest.approx(4.0, abs=0.11)
    goal = first[1].goal_m
    assert goal is not None
    # It was "in sight" for 2 s more, during which the vehicle came down 1 m.
    assert goal[2] == pytest.approx(height - 1.0 + 1.5, abs=0.1)
    assert goal[:2] == pytest.approx(PLACE, abs=0.05)


def test_a_retry_may_go_above_the_target_instead() -> None:
    seen_from, goals = (3.0, 3.0), []
    for behave in (0, 1):
        landing = PrecisionLanding(replace(P, plnd_ret_behave=behave))
        last = see(landing.target, 0.0, 3.0)
        landing.update(last, (*seen_from, 5.0), 5.0)
        goals.append(landing.update(last + 4.5, (*seen_from, 4.0), 4.0).goal_m)
    assert goals[0] == (3.0, 3.0, 6.5)
    assert goals[1] == pytest.approx((*PLACE, 6.5))


def test_retries_are_counted_and_then_it_fails() -> None:
    flight = Descent(6.0, replace(P, plnd_ret_max=2, plnd_strict=2))
    flight.run(4.0, seen=True)
    assert flight.run(60.0) == ["land on target", "descend", "retry", "hold"]
    assert flight.landing.retries == 2
    goals = {order.goal_m for _, order in flight.log if order.goal_m is not None}
    assert len(goals) == 2  # up and down again, twice the same way
    assert flight.landing.status == "failed"


def test_no_retry_is_made_where_none_is_allowed() -> None:
    flight = Descent(6.0, replace(P, plnd_ret_max=0))
    flight.run(4.0, seen=True)
    assert "retry" not in flight.run(6.0)


def test_a_target_that_comes_back_ends_the_retry_and_the_failure() -> None:
    flight = Descent(6.0)
    flight.run(4.0, seen=True)
    flight.run(4.5)
    assert flight.landing.status == "retry 1: climb"
    flight.run(2.5, seen=True)
    assert flight.log[-1][1].action == "land on target"
    flight = Descent(7.0, replace(P, plnd_strict=2))
    assert flight.run(5.0) == ["hold"]
    flight.run(2.5, seen=True)
    assert flight.log[-1][1].action == "land on target"


def test_a_target_far_away_or_long_ago_is_no_recent_one() -> None:
    landing = PrecisionLanding(P)
    last = see(landing.target, 0.0, 3.0)
    landing.update(last, (0.0, 0.0, 5.0), 5.0)
    assert landing.update(last + 5.0, (40.0, 0.0, 5.0), 5.0).action == "hold"
    landing = PrecisionLanding(P)
    last = see(landing.target, 0.0, 3.0)
    landing.update(last, (0.0, 0.0, 5.0), 5.0)
    assert landing.update(last + 181.0, (0.0, 0.0, 5.0), 5.0).action == "hold"
