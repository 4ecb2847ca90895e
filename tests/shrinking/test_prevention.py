from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pytest_garl.cases.case import NOT_ASKED
from pytest_garl.execution.flight_id import CompletedFlight, FlightId
from pytest_garl.execution.fly_and_judge import fly_job
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import reference_to
from pytest_garl.flight.flight import Step
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import Command, Observation, VelocitySetpoint
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.files import loads
from pytest_garl.shrinking import prevention
from pytest_garl.shrinking.case_flights import recorded_behaviour
from pytest_garl.shrinking.clearance import KEPT_M, Clearance, escaped
from pytest_garl.shrinking.escape_plan import find_escape
from pytest_garl.shrinking.prevention import Collision, collision_of, prevention_of
from pytest_garl.simulation.fly import fly
from tests.support.blind_lander import (
    LAWN,
    BlindLander,
    blind_flight,
    completed,
    job_of,
    scenario_with,
)

pytestmark = pytest.mark.sim
DOG = "dog-1"
LEVEL = (0.0, 0.0, 0.0, 1.0)


def collision(folder: Path, policy: str = "dqn") -> Collision:
    """Return the collision of the blind lander with a dog that a policy moves."""
    scenario, done = scenario_with(DOG), completed(blind_flight(DOG, policy), folder)
    behaviour = recorded_behaviour(done, scenario, LAWN)
    found = collision_of(job_of(policy, folder), scenario, behaviour, done, LAWN)
    assert found is not None
    return found


class Flights:
    """Flies the jobs of one collision in this process, and counts them."""

    def __init__(self, collision: Collision) -> None:
        self._collision, self.jobs = collision, list[FlightJob]()

    def __call__(self, job: FlightJob) -> CompletedFlight:
        self.jobs.append(job)
        flight = FlightId(search=f"{len(self.jobs):016d}", map=job.map)
        result, sha256, _ = fly_job(job, self._collision.scenario, flight, None)
        return CompletedFlight(result=result, sha256=sha256, record=job.record(flight))


def seen_from(collision: Collision, before_s: float) -> Collision:
    """Return a collision whose camera showed the dog from a time before the contact on."""
    flight, contact_s = collision.flight, collision.contact.time_s

    def shown(step: Step) -> Step:
        if step.time_s < contact_s - before_s - 0.11:
            return dataclasses.replace(step, objects_visible=(), objects_px=())
        return dataclasses.replace(step, objects_visible=(DOG,), objects_px=(400,))

    steps = tuple(shown(step) for step in flight.steps)
    return dataclasses.replace(collision, flight=dataclasses.replace(flight, steps=steps))


def test_escape_from_a_chasing_dog_is_confirmed_by_one_flight(tmp_path: Path) -> None:
    chased = seen_from(collision(tmp_path), 3.0)
    fly = Flights(chased)
    found = prevention_of(chased, fly, 3)
    assert found.answer == "preventable"
    assert found.inevitable_s is not None
    assert found.inevitable_s < 2.0
    assert found.observed_s == pytest.approx(3.0, abs=0.11)
    (job,) = fly.jobs
    # The dog reads the UAV's position, so it goes on live.
    assert job.npcs.name == "recorded, then dqn"


def test_the_blind_pilot_knows_the_marker_in_the_frame_of_its_own_estimate(tmp_path: Path) -> None:
    certain = collision(tmp_path)
    x, y = certain.flight.marker_position_m
    errs = {"navigation.position_m": 2.0, "navigation.towards_deg": 90.0}
    erring = dataclasses.replace(certain, scenario=certain.scenario.replace(errs))
    takeovers = [
        certain.job_of("blind", 5.0).takeover,
        erring.job_of("escape", 0.0).takeover,
        erring.job_of("blind", 0.0).takeover,
    ]
    goals = [takeover.marker_m for takeover in takeovers if takeover is not None]
    assert goals[:2] == [(x, y), (x, y)]
    assert goals[2] == pytest.approx((x, y + 2.0))


def test_dog_that_does_not_react_repeats_its_moves(tmp_path: Path) -> None:
    crossed = collision(tmp_path, "greedy")
    fly = Flights(crossed)
    assert prevention_of(crossed, fly, 3).answer != "unpreventable"
    assert {job.npcs.name for job in fly.jobs} == {"recorded"}


@pytest.mark.parametrize("before_s", [0.0, 0.3])
def test_dog_that_the_camera_shows_too_late_is_sensor_limited(
    tmp_path: Path, before_s: float
) -> None:
    late = seen_from(collision(tmp_path), before_s)
    found = prevention_of(late, Flights(late), 3)
    assert found.answer == "sensor-limited"


def test_collision_without_any_escape_is_unpreventable_and_takes_no_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chased = collision(tmp_path)
    monkeypatch.setattr(prevention, "find_escape", lambda *_: None)
    fly = Flights(chased)
    found = prevention_of(chased, fly, 3)
    assert (found.answer, found.inevitable_s) == ("unpreventable", 5.0)
    assert not fly.jobs


def test_escape_that_no_flight_confirms_leaves_the_question_open(tmp_path: Path) -> None:
    chased = collision(tmp_path)
    flown: list[FlightJob] = []

    def fly(job: FlightJob) -> CompletedFlight:
        flown.append(job)
        # The landing system's own flight, in which the dog hits it.
        return completed(chased.flight, tmp_path, f"again-{len(flown)}")

    assert prevention_of(chased, fly, 2) == NOT_ASKED
    assert len(flown) == 2


class StandsThere(BlindLander):
    """Comes down, and holds its place on the ground with running motors."""

    def step(self, observation: Observation) -> Command:
        height_m = float(observation.position_m[2])
        if not self.climbed or height_m > 0.3:
            return super().step(observation)
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, -0.3 if height_m > 0.26 else 0.0))


PASSER_BY = """
schema = 2
map = "lawn"
seed = 1
[scenario.marker]
x_m = 2.0
y_m = 1.0
[scenario.told]
surveyed = 1.0
[scenario.person-1]
start_x_m = 4.0
start_y_m = 1.0
speed_mps = 1.4
grade = "careless"
phase = "touchdown"
crosses_x_m = 0.0
crosses_y_m = 0.0
"""


def passer_by(folder: Path, delay_s: float) -> tuple[Collision, Flights]:
    """Return the collision of a person with a UAV that stands on its marker."""
    scenario = loads(f"{PASSER_BY}delay_s = {delay_s}\n", LAWN)
    done = completed(
        fly(scenario, StandsThere, policy_spec("graded"), map=LAWN, time_limit_s=60.0), folder
    )
    job = FlightJob.for_system(
        reference_to(StandsThere), LAWN, policy_spec("graded"), flights=folder
    )
    behaviour = recorded_behaviour(done, scenario, LAWN)
    found = collision_of(job, scenario, behaviour, done, LAWN)
    assert found is not None
    return found, Flights(found)


def test_a_uav_that_stands_on_the_ground_escapes_by_stopping_its_motors(tmp_path: Path) -> None:
    stands, fly = passer_by(tmp_path, 3.0)
    found = prevention_of(stands, fly, 3)
    assert (found.answer, found.escape) == ("preventable", "motors off")
    assert found.inevitable_s is not None
    assert found.inevitable_s <= 1.0
    assert found.observed_s is None
    assert "stopping the motors is an escape that needs no camera" in found.text
    takeover = fly.jobs[0].takeover
    assert takeover is not None
    assert takeover.pilot == "stop"


def test_a_uav_cannot_stop_its_motors_in_the_first_second_after_its_touchdown(
    tmp_path: Path,
) -> None:
    stands, fly = passer_by(tmp_path, 0.0)
    since_s = stands.stood_since_s()
    assert since_s is not None
    assert stands.contact.time_s - since_s < 2.0
    assert prevention_of(stands, fly, 3).escape == "flight"
    assert {job.takeover.pilot for job in fly.jobs if job.takeover} <= {"escape"}


def test_flight_that_is_another_before_the_takeover_confirms_nothing(tmp_path: Path) -> None:
    chased = collision(tmp_path)
    track = chased.flight.uav
    moved = dataclasses.replace(track, position_m=track.position_m + 1e-9)
    assert chased.same_until(chased.flight, 10.0)
    assert not chased.same_until(dataclasses.replace(chased.flight, uav=moved), 10.0)


def test_model_predicts_the_flight_that_confirms_it(tmp_path: Path) -> None:
    chased = collision(tmp_path)
    fly = Flights(chased)
    from_s = chased.takeover_s(1.5)
    assert chased.contact.time_s - from_s <= 1.5
    with chased.world() as world:
        model = chased.model(from_s, world)
        legs = find_escape(model, DOG, chased.contact.time_s)
        assert legs is not None
        done = fly(chased.job_of("escape", from_s, legs))
        assert chased.survives(done, from_s, world)
        flown = load(done.record)
        index = int(np.searchsorted(flown.uav.time_s, from_s + 1e-6, side="right")) - 1
        assert model.position_m() == pytest.approx(flown.uav.position_m[index])
        assert not escaped(chased.flight, world, from_s, chased.until_s)


def test_collision_with_a_static_body_is_not_asked(tmp_path: Path) -> None:
    done = completed(blind_flight(DOG, "dqn"), tmp_path)
    flight = load(done.record)
    tree = dataclasses.replace(flight.contacts[-1], body="tree-1", body_class="static")
    hit = completed(dataclasses.replace(flight, contacts=(tree,)), tmp_path, "tree")
    scenario = scenario_with(DOG)
    behaviour = recorded_behaviour(hit, scenario, LAWN)
    assert collision_of(job_of("dqn", tmp_path), scenario, behaviour, hit, LAWN) is None


def test_clearance_keeps_its_distance_from_bodies_and_ground(tmp_path: Path) -> None:
    chased = collision(tmp_path)
    far = (DOG, (4.0, 0.0, 0.0), 0.0)
    with chased.world() as world:

        def holds(*heights: float, after_s: float = 2.0, dog: float = 4.0) -> bool:
            clearance = Clearance(world)
            clearance.holds(0.0, (0.0, 0.0, heights[0]), LEVEL, [far])
            place = (DOG, (dog, 0.0, 0.0), 0.0)
            return clearance.holds(after_s, (0.0, 0.0, heights[-1]), LEVEL, [place])

        # The feet are 0.2 m below the body.
        assert holds(3.0, 0.2 + KEPT_M + 0.01)
        assert not holds(3.0, 0.2 + KEPT_M - 0.01)
        # Near the ground at first: it may stay there for a second, and come no nearer.
        assert holds(0.4, 0.4, after_s=0.5)
        assert not holds(0.4, 0.3, after_s=0.5)
        assert not holds(0.4, 0.4)
        # The dog is 0.58 m long from its middle, the hull half a metre.
        assert holds(1.0, 0.8, dog=1.7)
        assert not holds(1.0, 0.8, dog=0.9)
