"""Stays on the ground: when the motors stop, what counts as landed, and what as slid."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_garl import (
    Abort,
    Airframe,
    AttitudeSetpoint,
    Command,
    Land,
    Mission,
    MotorThrusts,
    Observation,
    VehicleState,
    VelocitySetpoint,
)
from pytest_garl.flight.flight import Flight, Outcome, Touchdown
from pytest_garl.flight.thresholds import GRAVITY_MPS2
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.ground_periods import GroundPeriods
from pytest_garl.simulation.physics.vehicle import REFERENCE_MASS_KG, vehicle_model
from pytest_garl.simulation.recorder import Recorder
from tests.support.engines import engine
from tests.support.flights import EMPTY, STAND, Scripted, nominal

__all__ = ["engine"]
pytestmark = pytest.mark.usefixtures("engine")

WEIGHT_N = REFERENCE_MASS_KG * GRAVITY_MPS2
ON_FEET_M = 0.21


class DescendsThen(Scripted):
    """Drifts north while it descends; what it does on the ground is ``on_ground``."""

    drift_mps = 0.0
    speed_mps = 0.5

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.touched_s: float | None = None

    def step(self, observation: Observation) -> Command:
        if observation.time_s < 4:
            return self.hover(2.0)
        if observation.position_m[2] < ON_FEET_M and self.touched_s is None:
            self.touched_s = observation.time_s
        if self.touched_s is not None:
            return self.on_ground(observation.time_s - self.touched_s)
        return VelocitySetpoint(velocity_mps=(0.0, self.drift_mps, -self.speed_mps))

    def on_ground(self, after_s: float) -> Command:
        return Land()


class Drifts(DescendsThen):
    drift_mps = 1.0


class Skids(DescendsThen):
    """Flies on along the ground, with its motors running."""

    drift_mps = 2.0

    def on_ground(self, after_s: float) -> Command:
        return VelocitySetpoint(velocity_mps=(0.0, 2.0, 0.0))


class SkidsToAStop(DescendsThen):
    drift_mps = 2.0


class StandsAtHeightZero(DescendsThen):
    def on_ground(self, after_s: float) -> Command:
        return self.hover(0.0)


class HoversOnItsFeet(DescendsThen):
    def on_ground(self, after_s: float) -> Command:
        return self.hover(0.2)


class CutsThrustByAttitude(DescendsThen):
    def on_ground(self, after_s: float) -> Command:
        return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=0.02)


class GivesUpOnTheGround(DescendsThen):
    def on_ground(self, after_s: float) -> Command:
        return Abort() if after_s > 0.5 else Land()


class GivesUpAfterTheStop(DescendsThen):
    def on_ground(self, after_s: float) -> Command:
        return Abort() if after_s > 2.0 else Land()


class TouchesAndGoes(DescendsThen):
    """Touches the ground, climbs to 1.5 m, and lands a metre farther north."""

    def on_ground(self, after_s: float) -> Command:
        if after_s < 0.4:
            return Land()
        if after_s < 3.0:
            return VelocitySetpoint(velocity_mps=(0.0, 0.5, 1.0))
        return Land()


class FallsOnTheSecondTouchdown(TouchesAndGoes):
    def on_ground(self, after_s: float) -> Command:
        if after_s < 3.0:
            return super().on_ground(after_s)
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, -4.0))


class CutsThrust:
    """Flies the motors itself: sinks at 0.5 m/s from 1.5 m, and stops them on the ground."""

    airframe = Airframe(latency_s=0.0, control_rate_hz=240)
    needs_camera = False

    def reset(self, mission: object) -> None:
        pass

    def step(self, observation: Observation) -> Command:
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, -0.5))

    def control(self, state: VehicleState) -> MotorThrusts:
        height, climb = state.position_m[2], state.velocity_mps[2]
        if state.time_s > 4 and height < ON_FEET_M:
            return MotorThrusts(newtons=(0.0, 0.0, 0.0, 0.0))
        wanted = (1.5 - height) if state.time_s < 4 else -0.5
        thrust = WEIGHT_N + REFERENCE_MASS_KG * 4 * (wanted - climb)
        return MotorThrusts(newtons=(thrust / 4,) * 4)


def flown(system: type, seconds: float = 20.0, **genes: float) -> tuple[Flight, Touchdown]:
    flight = fly(nominal(**genes), system, STAND, map=EMPTY, time_limit_s=seconds)
    assert flight.touchdown is not None
    return flight, flight.touchdown


def _needs_a_slide(engine: str) -> None:
    if engine == "mujoco":
        pytest.skip("a UAV that skids over the ground with its motors running hops there")


@pytest.mark.parametrize(
    "system", [DescendsThen, StandsAtHeightZero, CutsThrustByAttitude, CutsThrust]
)
def test_uav_lands_when_its_motors_stopped_and_it_stays_two_seconds(system: type) -> None:
    flight, touchdown = flown(system)
    assert flight.outcome == "landed"
    assert touchdown.stopped_s is not None
    assert 1.0 <= touchdown.stopped_s - touchdown.time_s < 1.5
    assert flight.elapsed_s == pytest.approx(touchdown.stopped_s + 2.0, abs=0.01)
    assert touchdown.speed_mps == pytest.approx(0.55, abs=0.2)
    assert touchdown.slid_m < 0.05
    assert [event.name for event in flight.events][-3:] == ["contact", "motors_stopped", "landed"]


@pytest.mark.parametrize("speed_mps", [0.2, 0.5, 1.0, 1.8])
def test_motors_stop_within_a_second_and_a_half_of_every_landing(speed_mps: float) -> None:
    class LandsAtSpeed(DescendsThen):
        def on_ground(self, after_s: float) -> Command:
            return Land(speed_mps=speed_mps)

    LandsAtSpeed.speed_mps = speed_mps
    _, touchdown = flown(LandsAtSpeed)
    assert touchdown.stopped_s is not None
    assert touchdown.stopped_s - touchdown.time_s < 1.5


def test_uav_that_hovers_on_its_feet_does_not_land() -> None:
    flight, touchdown = flown(HoversOnItsFeet)
    assert flight.outcome == "not_landed"
    assert flight.elapsed_s == pytest.approx(20.0, abs=0.01)
    assert touchdown.stopped_s is None


def test_uav_that_drifts_at_touchdown_comes_to_rest_by_friction() -> None:
    flight, touchdown = flown(Drifts)
    assert flight.outcome == "landed"
    assert 0.1 < touchdown.slid_m < 0.5
    assert touchdown.stopped_s is not None


def test_uav_that_skids_to_a_stop_has_slid() -> None:
    flight, touchdown = flown(SkidsToAStop)
    assert flight.outcome == "slid"
    assert 0.5 < touchdown.slid_m < 1.2
    assert np.linalg.norm(flight.uav.velocity_mps[-1]) < 0.2


def test_slide_is_watched_for_two_seconds_with_motors_running(engine: str) -> None:
    _needs_a_slide(engine)
    flight, touchdown = flown(Skids)
    slid_s = next(event.time_s for event in flight.events if event.name == "slid")
    assert flight.outcome == "slid"
    assert flight.elapsed_s == pytest.approx(slid_s + 2.0, abs=0.01)
    assert touchdown.stopped_s is None
    assert touchdown.slid_m > 0.5


@pytest.mark.parametrize("wind_mps", [4.0, 6.0, 8.0, 10.0])
def test_wind_does_not_push_a_landed_uav(wind_mps: float) -> None:
    flight, touchdown = flown(DescendsThen, wind__mean_mps=wind_mps, wind__towards_deg=45.0)
    assert flight.outcome == "landed"
    assert touchdown.slid_m < 0.3


def test_abort_before_the_motors_stopped_takes_off() -> None:
    flight, touchdown = flown(GivesUpOnTheGround)
    assert flight.outcome == "gave_up"
    assert touchdown.stopped_s is None


def test_abort_after_the_motors_stopped_changes_nothing() -> None:
    flight, _ = flown(GivesUpAfterTheStop)
    assert flight.outcome == "landed"
    assert flight.uav.position_m[-1][2] < ON_FEET_M


def test_record_holds_every_touchdown() -> None:
    flight, touchdown = flown(TouchesAndGoes)
    assert flight.outcome == "landed"
    assert [contact.body for contact in flight.contacts] == ["ground", "ground"]
    (first,) = flight.earlier_touchdowns
    assert first.stopped_s is None
    assert touchdown.time_s > first.time_s + 2.5
    assert touchdown.position_m[1] - first.position_m[1] > 0.8
    assert first.distance_m == pytest.approx(
        math.dist(first.position_m[:2], flight.marker_position_m)
    )


def test_second_touchdown_may_be_too_hard() -> None:
    flight, touchdown = flown(FallsOnTheSecondTouchdown)
    assert flight.outcome == "collision"
    assert flight.contacts[-1].body == "ground"
    assert touchdown.speed_mps > 2.0
    assert len(flight.earlier_touchdowns) == 1


def test_uav_that_touches_down_in_time_may_come_to_rest_after_the_limit() -> None:
    whole, touchdown = flown(DescendsThen)
    flight, _ = flown(DescendsThen, seconds=touchdown.time_s + 0.1)
    assert flight.outcome == "landed"
    assert flight.elapsed_s == whole.elapsed_s
    late = fly(nominal(), DescendsThen, STAND, map=EMPTY, time_limit_s=touchdown.time_s - 0.1)
    assert late.outcome == "not_landed"


def test_contact_while_the_uav_slides_changes_nothing(engine: str) -> None:
    _needs_a_slide(engine)
    _, free = flown(Skids)
    x, y, _ = free.position_m
    tree = dataclasses.replace(EMPTY.bodies[0], position_m=(x, y + 2.0, 0.0))
    map = dataclasses.replace(EMPTY, bodies=(tree,))
    flight = fly(nominal(), Skids, STAND, map=map, time_limit_s=20.0)
    assert flight.outcome == "slid"
    assert flight.contacts[-1].body == tree.name


class TestGroundPeriods:
    """The stays by themselves, step by step."""

    def setup_method(self) -> None:
        self.recorder = Recorder(Placed(nominal(), EMPTY), ())
        self.stays = GroundPeriods(
            self.recorder, vehicle_model(Airframe()), (0.0, 0.0), lambda place: "nothing"
        )
        self.time_s = 0.0

    def fly(
        self, seconds: float, *, contact: bool = True, tilt_rad: float = 0.0, **motion: float
    ) -> Outcome | None:
        """Fly on, with the motors off unless ``motion`` has a thrust; stop at the outcome."""
        x, speed = motion.get("x", 0.0), motion.get("speed", 0.0)
        thrust_n = motion.get("thrust_n", 0.0)
        for _ in range(round(seconds * 240)):
            self.time_s += 1 / 240
            place = (x, 0.0, 0.2)
            contact_m = place if contact else None
            velocity = (speed, 0.0, 0.0)
            outcome = self.stays.update(self.time_s, contact_m, place, velocity, tilt_rad, thrust_n)
            if outcome:
                return outcome
        return None

    def test_uav_that_tips_over_after_the_stop_collides_with_the_ground(self) -> None:
        assert self.fly(1.5) is None
        assert self.stays.motors_stopped
        assert self.fly(0.1, tilt_rad=math.radians(21)) == "collision"
        assert self.recorder.last_contact == "ground"

    def test_uav_that_lies_still_but_is_pushed_over_has_landed(self) -> None:
        self.fly(1.5)
        self.stays.was_pushed = True
        assert self.fly(2.0, tilt_rad=1.0, x=3.0, speed=0.5) == "landed"
        assert self.stays.touchdowns[-1].slid_m == 0.0

    def test_uav_that_still_moves_is_watched_until_it_rests(self) -> None:
        self.fly(1.5)
        assert self.fly(3.0, speed=0.25) is None
        assert self.fly(0.1, speed=0.1) == "landed"

    def test_short_bounce_belongs_to_the_stay(self) -> None:
        self.fly(0.5, thrust_n=WEIGHT_N)
        self.fly(0.2, contact=False, thrust_n=WEIGHT_N)
        self.fly(0.1, thrust_n=WEIGHT_N)
        assert len(self.stays.touchdowns) == 1
        self.fly(0.3, contact=False, thrust_n=WEIGHT_N)
        assert self.stays.since_s is None
        self.fly(0.1)
        assert len(self.stays.touchdowns) == 2

    def test_way_through_the_air_is_no_slide(self) -> None:
        self.fly(0.2)
        self.fly(0.2, contact=False, x=0.8)
        assert self.stays.touchdowns[-1].slid_m == 0.0
        self.fly(0.1, x=0.4)
        assert self.stays.touchdowns[-1].slid_m == pytest.approx(0.4)
        assert not self.stays.has_slid
