"""What flights teach a director, compared with flights; and a director that learns from them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Command, Observation, PositionSetpoint, VelocitySetpoint
from pytest_garl.npcs.encounter import begins_at
from pytest_garl.npcs.lessons import (
    APART,
    IN_VIEW,
    UNSEEN,
    Forecast,
    Lesson,
    Response,
    lessons_of,
    sinking_mps,
)
from pytest_garl.npcs.own_director import OwnDirector, mean_worth
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY_MOMENTS
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from tests.support.flights import Scripted
from tests.support.stories import EMPTY, scenario_with

NEVER_S = 60.0
DECIDED = float(STORY_MOMENTS.index("decided"))
TIME_LIMIT_S = 28.0


class Sinks(Scripted):
    """Comes down on the marker and looks at nothing."""

    def step(self, observation: Observation) -> Command:
        if observation.time_s < 12:
            return PositionSetpoint(position_m=(0.0, 0.0, 9.0))
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, -0.8))


def chasing(speed: float = 2.0, **values: float) -> Scenario:
    told = {"grade": 2.0, "phase": 0.0, "lasts_s": 5.0, "delay_s": NEVER_S, **values}
    return scenario_with("person-1", (-9.0, 3.0), speed, told)


def flown(scenario: Scenario) -> Flight:
    return fly(scenario, Sinks, policy_spec("graded"), map=EMPTY, time_limit_s=TIME_LIMIT_S)


def lesson_of(flight: Flight, scenario: Scenario) -> Lesson:
    (lesson,) = lessons_of(flight, scenario, EMPTY, Sinks.airframe, 0.5)
    return lesson


@pytest.fixture(scope="module")
def waiting() -> tuple[Scenario, Flight]:
    scenario = chasing()
    return scenario, flown(scenario)


@pytest.mark.sim
def test_forecasts_come_true_if_the_uav_takes_no_notice(waiting: tuple[Scenario, Flight]) -> None:
    scenario, flight = waiting
    lesson = lesson_of(flight, scenario)
    assert flight.outcome == "landed"
    assert not lesson.met
    assert lesson.own is None, "it never began"
    kinds = {}
    for number, forecast in zip(lesson.asked, lesson.forecasts, strict=True):
        begun = flown(begins_at(scenario, "person-1", number * DECISION_STEP_S))
        met = begun.outcome == "collision" and begun.touchdown is None
        assert met == (forecast.kind != APART), number
        kinds[number] = forecast.kind
    assert len(set(kinds.values())) > 1, kinds


@pytest.mark.sim
def test_what_comes_after_the_first_picture_of_the_npc_is_forecast_by_its_descent(
    waiting: tuple[Scenario, Flight],
) -> None:
    scenario, alone = waiting
    before = lesson_of(alone, scenario)
    meets = max(
        number
        for number, forecast in zip(before.asked, before.forecasts, strict=True)
        if forecast.kind != APART
    )
    begun = begins_at(scenario, "person-1", meets * DECISION_STEP_S)
    flight = flown(begun)
    assert lesson_of(flight, begun).own is None, "the UAV never saw it"
    steps = tuple(
        dataclasses.replace(step, objects_visible=("person-1",) * (step.time_s > seen_s))
        for seen_s in [(meets + 1) * DECISION_STEP_S]
        for step in flight.steps
    )
    lesson = lesson_of(dataclasses.replace(flight, steps=steps), begun)
    assert lesson.met
    assert lesson.own is not None
    assert lesson.own.kind != APART
    assert not lesson.own.is_certain


def test_a_uav_tells_how_fast_it_sinks(waiting: tuple[Scenario, Flight]) -> None:
    _, flight = waiting
    assert sinking_mps(flight) == pytest.approx(0.8, abs=0.08)
    assert sinking_mps(dataclasses.replace(flight, moments=(("start", 0.0),))) is None


def test_a_response_is_learned_from_what_happened() -> None:
    response = Response()
    meets = Forecast(kind=IN_VIEW, nearest_m=0.2, is_certain=False)
    assert response.share(meets) == 0.5
    for met in (False, False, False, True):
        response.learn(meets, met)
    assert response.share(meets) == pytest.approx(2 / 6)
    assert response.share(dataclasses.replace(meets, kind=UNSEEN)) == 0.75
    certain = dataclasses.replace(meets, is_certain=True)
    assert response.share(certain) == 1
    assert response.share(dataclasses.replace(certain, kind=APART)) == 0


def test_what_could_have_been_prevented_is_worth_most_and_a_near_miss_little() -> None:
    response = Response()
    in_view, unseen, near, far = (
        response.worth(Forecast(kind=kind, nearest_m=nearest_m, is_certain=True))
        for kind, nearest_m in ((IN_VIEW, 0.2), (UNSEEN, 0.2), (APART, 1.0), (APART, 9.0))
    )
    assert (in_view, unseen, far) == (1.0, 0.25, 0.0)
    assert 0 < near < 0.05


@pytest.mark.sim
def test_a_director_learns_from_flights_and_the_same_flights_give_the_same_bytes(
    waiting: tuple[Scenario, Flight],
) -> None:
    scenario, flight = waiting
    first, second = (OwnDirector(EMPTY, Sinks.airframe) for _ in range(2))
    assert first.text == "", "the weights that ship, until a flight taught something"
    assert first.learn([]).npcs == 0
    progress = first.learn([(scenario, flight)] * 4)
    assert progress.npcs == 4
    assert progress.learned == progress.shipped
    assert progress.learned <= progress.best
    second.learn([])
    second.learn([(scenario, flight)] * 4)
    assert first.text == second.text != ""
    again = first.learn([(scenario, flight)])
    assert again.learned >= again.shipped


@pytest.mark.sim
def test_who_could_not_have_begun_teaches_nothing(waiting: tuple[Scenario, Flight]) -> None:
    scenario, flight = waiting
    careless = scenario.replace({"person-1.grade": 0.0})
    assert not list(lessons_of(flight, careless, EMPTY, Sinks.airframe, 0.5))
    stands = scenario.replace({"person-1.velocity": 0.0})
    lessons = list(lessons_of(flight, stands, EMPTY, Sinks.airframe, 0.5))
    assert all(each.own is None for each in lessons)


def test_a_director_is_worth_what_its_begins_are(waiting: tuple[Scenario, Flight]) -> None:
    class Goes:
        def __init__(self, number: int) -> None:
            self.left = number

        def decides(self, features: np.ndarray) -> bool:
            self.left -= 1
            return self.left < 0

    lesson = lesson_of(waiting[1], waiting[0]).worths(Response())
    assert mean_worth(Goes(3), [lesson]) == pytest.approx(lesson.go[3])
    assert mean_worth(Goes(10**6), [lesson]) == lesson.never
