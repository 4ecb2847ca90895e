from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import (
    Airframe,
    Command,
    Mission,
    MotorThrusts,
    Observation,
    VehicleState,
    VelocitySetpoint,
)
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.ground_truth import truth_pilot_of
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from pytest_garl.simulation.system_under_test.takeover import (
    Leg,
    Takeover,
    velocity_of,
    with_takeover,
)
from tests.support.blind_lander import LAWN, BlindLander, blind_flight, scenario_with

UP = Leg(velocity_mps=(0.0, 0.0, 3.0), duration_s=1.0)
EAST = Leg(velocity_mps=(2.0, 0.0, 0.0), duration_s=0.5)
FROM_S = 9.1


def test_legs_follow_each_other_and_end_in_a_hover() -> None:
    legs = (UP, EAST)
    assert velocity_of(legs, 0.0) == velocity_of(legs, 0.9) == UP.velocity_mps
    assert velocity_of(legs, 1.0) == EAST.velocity_mps
    assert velocity_of(legs, 1.5) == (0.0, 0.0, 0.0)


def taken_over(takeover: Takeover, policy: str = "stationary") -> Flight:
    system = with_takeover(BlindLander, takeover)
    return fly(scenario_with("dog-1"), system, policy_spec(policy), map=LAWN)


def takeover(pilot: Any, *legs: Leg, until_s: float = 13.0) -> Takeover:
    marker = blind_flight("dog-1", "stationary").marker_position_m
    return Takeover(
        pilot=pilot,
        from_s=FROM_S,
        until_s=until_s,
        legs=legs,
        marker_m=marker,
    )


@pytest.mark.sim
def test_flight_is_the_same_to_the_byte_until_the_takeover() -> None:
    own, other = blind_flight("dog-1", "stationary"), taken_over(takeover("escape", UP))
    count = int(np.searchsorted(own.uav.time_s, FROM_S, side="right"))
    for name in ("position_m", "attitude", "velocity_mps"):
        before, after = getattr(own.uav, name), getattr(other.uav, name)
        assert before[:count].tobytes() == after[:count].tobytes()
    assert not np.array_equal(own.uav.position_m[count + 5], other.uav.position_m[count + 5])


@pytest.mark.sim
def test_escape_flies_its_legs_hovers_and_gives_up() -> None:
    flight = taken_over(takeover("escape", UP, until_s=13.0))
    at = {s: flight.uav.position_m[int(np.searchsorted(flight.uav.time_s, s))] for s in (9, 11, 13)}
    assert at[11][2] > at[9][2] + 2.0
    assert abs(at[13][2] - at[11][2]) < 0.7
    assert flight.outcome == "gave_up"
    assert 13.0 < flight.elapsed_s < 16.0


@pytest.mark.sim
def test_blind_pilot_goes_on_and_lands_on_the_marker() -> None:
    flight = taken_over(takeover("blind", until_s=60.0))
    assert flight.outcome == "landed"
    assert flight.final_distance_m < 0.5


@pytest.mark.sim
def test_holding_pilot_repeats_the_last_command() -> None:
    flight = taken_over(takeover("hold", until_s=12.0))
    before = [step.command for step in flight.steps if step.time_s < FROM_S - 0.1][-1]
    held = {step.command for step in flight.steps if FROM_S - 0.1 <= step.time_s < 11.8}
    assert held == {before}


class OwnControl:
    """Flies its own motors, with the thrusts that the test looks for."""

    airframe = Airframe(control_rate_hz=240)

    def reset(self, mission: Mission) -> None: ...

    def step(self, observation: Observation) -> Command:
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, 0.0))

    def control(self, state: VehicleState) -> MotorThrusts:
        return MotorThrusts(newtons=(1.0, 2.0, 3.0, 4.0))


STATE = VehicleState(
    time_s=9.0,
    position_m=(0.0, 0.0, 5.0),
    velocity_mps=(0.0, 0.0, 0.0),
    attitude=(0.0, 0.0, 0.0, 1.0),
    angular_velocity_radps=(0.0, 0.0, 0.0),
    thrusts_n=(0.0, 0.0, 0.0, 0.0),
)


def test_pilot_takes_over_a_system_with_its_own_flight_control() -> None:
    own = with_takeover(OwnControl, takeover("escape", UP))()
    assert own.control(STATE).newtons == (1.0, 2.0, 3.0, 4.0)
    later = dataclasses.replace(STATE, time_s=FROM_S)
    thrusts = own.control(later).newtons
    assert thrusts[0] == pytest.approx(thrusts[3])
    # It climbs: more than the weight.
    assert sum(thrusts) > 2.355 * 9.81
    held = with_takeover(OwnControl, takeover("hold"))()
    assert held.control(later).newtons == (1.0, 2.0, 3.0, 4.0)


def test_attributes_of_the_landing_system_are_seen_through() -> None:
    system = with_takeover(ReferencePilot, takeover("hold"))()
    assert system.needs_camera is False
    assert isinstance(truth_pilot_of(system), ReferencePilot)
    assert with_takeover(ReferencePilot, takeover("hold")).needs_camera is False  # type: ignore[attr-defined]
    assert truth_pilot_of(with_takeover(BlindLander, takeover("hold"))()) is None
