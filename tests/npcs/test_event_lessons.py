"""What flights teach a director of events, and a director that learns when events should strike."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from math import inf

import numpy as np
import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.directed import event_director_of
from pytest_garl.npcs.director_progress import AND_EVENTS, Outcome
from pytest_garl.npcs.event_lessons import (
    GUESS,
    EventLesson,
    EventResponse,
    OwnEventDirector,
    learned_kinds,
    lesson_of,
    rule_network,
)
from pytest_garl.npcs.event_watch import AT, EVENT_FEATURES, EventWatch, LearnedStrikes, inputs
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.groups import EVENTS
from pytest_garl.simulation.npc_policy import Outlook
from pytest_garl.simulation.strikes import AtThreeMetres
from tests.simulation.test_strikes import TELLS, Told, flown, waiting

FAILS, HOLDS = Outcome(violates=True, worth=1.0), Outcome(violates=False, worth=0.0)
SINKS_MPS, TOP_M = 0.5, 10.0


def descent(sinks_mps: float = SINKS_MPS) -> Iterator[Outlook]:
    """Yield what a director is shown of a UAV that comes down on the marker."""
    came = {m: (TOP_M - m) / sinks_mps for m in (8.0, 3.0, 0.1)}
    for number in range(int(2 * TOP_M / sinks_mps) + 1):
        now = number / 2
        moments = (0.0, *came.values(), 1.0, inf)
        yield Outlook(
            time_s=now,
            uav_position_m=(0.0, 0.0, TOP_M - sinks_mps * now),
            uav_velocity_mps=(0.0, 0.0, -sinks_mps),
            marker_position_m=(0.0, 0.0),
            moments_s=tuple(each if each <= now else inf for each in moments),
            is_readable=now >= 1.0,
        )


def lesson(event: str, struck_m: float, outcome: Outcome) -> EventLesson:
    """Return a descent in which an event strikes at a height."""
    watch = EventWatch()
    rows = np.array([watch.look(outlook) for outlook in descent()])
    struck = {event: round(2 * (TOP_M - struck_m) / SINKS_MPS)}
    return EventLesson(rows=rows, struck=struck, outcome=outcome)


def strikes_at_m(director: LearnedStrikes | AtThreeMetres, event: str) -> float:
    """Return the height at which an event strikes in a descent; -1 if it does not."""
    for outlook in descent():
        if event in director.strikes(outlook, (event,)):
            return outlook.uav_position_m[2]
    return -1.0


@pytest.mark.parametrize("event", EVENTS)
def test_the_network_from_which_it_starts_decides_as_the_rule(event: str) -> None:
    learned = strikes_at_m(LearnedStrikes(rule_network()), event)
    assert learned == strikes_at_m(AtThreeMetres(), event) == 3.0


def test_the_uav_is_seen_half_a_second_late_and_the_marker_at_once() -> None:
    watch, shown = EventWatch(), list(descent())
    rows = [watch.look(outlook) for outlook in shown]
    assert all(len(row) == len(EVENT_FEATURES) for row in rows)
    assert rows[8][AT["height"]] == pytest.approx(shown[7].uav_position_m[2] / 10)
    assert [row[AT["readable"]] for row in rows[:4]] == [0, 0, 1, 1]
    assert rows[10][AT["for"]] == pytest.approx(0.4)
    low = shown.index(next(each for each in shown if np.isfinite(each.moments_s[2])))
    assert [row[AT["passed_3_m"]] for row in rows[low - 1 : low + 1]] == [0, 1]
    assert rows[-1][AT["held"]] == 0


def test_each_kind_of_event_has_weights_of_its_own() -> None:
    rows = np.ones((2, len(EVENT_FEATURES)))
    found = [inputs(rows, event) for event in EVENTS]
    assert {each.sum() for each in found} == {2.0 * len(EVENT_FEATURES)}
    assert np.array_equal(sum(found), np.ones((2, len(EVENTS) * len(EVENT_FEATURES))))


def test_what_follows_a_strike_is_taken_from_like_states_and_events() -> None:
    response = EventResponse()
    low, high = lesson("jump", 1.0, FAILS), lesson("jump", 8.0, HOLDS)
    states = low.rows[[low.struck["jump"], high.struck["jump"]]]
    assert response.expected(states, "jump").tolist() == [[GUESS, GUESS]] * 2
    for _ in range(5):
        response.learn(low)
        response.learn(high)
    (at_low, _), (at_high, _) = response.expected(states, "jump")
    assert at_low > 0.7
    assert at_high < 0.2
    (other, _), _ = response.expected(states, "cover")
    assert at_high < other < at_low, "another kind of event says less"


def test_a_director_learns_in_which_state_an_event_hurts() -> None:
    own, again = OwnEventDirector(), OwnEventDirector()
    assert own.text == "", "the rule, until an event struck"
    generation = [
        lesson(event, height_m, FAILS if (event == "cover") == (height_m > 5) else HOLDS)
        for event in ("cover", "jump")
        for height_m in (9.0, 7.5, 6.0, 2.5, 1.0)
    ]
    first = own.learn_lessons(generation)
    assert (first.flights, first.struck, first.violated) == (10, 10, 5)
    assert first.expected == pytest.approx(10 * GUESS)
    assert first.learned == first.rule < first.best
    second = own.learn_lessons(generation)
    assert second.learned > second.rule
    assert second.expected > first.expected
    network = own.network
    assert strikes_at_m(LearnedStrikes(network), "cover") > 5
    assert 0 <= strikes_at_m(LearnedStrikes(network), "jump") <= 3
    again.learn_lessons(generation)
    again.learn_lessons(generation)
    assert again.text == own.text != ""


def test_weights_tell_the_kinds_of_events_that_strike_as_learned() -> None:
    rule = rule_network()
    (weight, bias) = rule.layers[0]
    changed = weight.copy()
    changed[1] += inputs(np.eye(len(EVENT_FEATURES))[:1], "cover")[0]
    learned = dataclasses.replace(rule, layers=((changed, bias),))
    assert learned_kinds("") == learned_kinds("time-to-go 0 0") == frozenset()
    assert learned_kinds(f"{AND_EVENTS}{rule.text}") == frozenset()
    assert learned_kinds(f"time-to-go 0 0{AND_EVENTS}{learned.text}") == {"cover"}


def test_a_flight_without_events_teaches_nothing_of_what_follows_strikes() -> None:
    own = OwnEventDirector()
    quiet = dataclasses.replace(lesson("jump", 1.0, FAILS), struck={})
    progress = own.learn_lessons([quiet])
    assert (progress.flights, progress.struck, progress.expected) == (1, 0, 0)
    assert own.text == ""


@pytest.mark.sim
def test_a_recorded_flight_is_a_lesson_up_to_the_strike() -> None:
    Told.at_s, scenario = 12.0, waiting("cover")
    found = lesson_of(scenario, flown(scenario, TELLS), HOLDS)
    Told.at_s = inf
    unstruck = lesson_of(scenario, flown(scenario, TELLS), HOLDS)
    assert found is not None
    assert unstruck is not None
    assert found.struck == {"cover": 24}
    assert len(found.waiting("cover")) == 25
    assert len(found.waiting("jump")) == len(found.rows) == len(unstruck.rows)
    assert "cover" not in found.whole
    assert [*unstruck.whole] == [*EVENTS]
    assert np.array_equal(found.waiting("cover"), unstruck.rows[:25])


@pytest.mark.parametrize("policy", ["graded", "curious", "chasing"])
def test_a_policy_lets_events_strike_by_the_weights_that_it_is_given(policy: str) -> None:
    spec = policy_spec(policy)
    assert spec.event_director() is None, "the rule ships"
    director = spec.directed_by(f"time-to-go 0 0{AND_EVENTS}{rule_network().text}")
    found = director.event_director()
    assert isinstance(found, LearnedStrikes)
    assert found is not director.event_director(), "each flight has one of its own"
    assert strikes_at_m(found, "outage") == 3.0
    director.make()
    assert policy_spec("stand").event_director() is None


def test_weights_of_events_that_are_damaged_are_an_error() -> None:
    with pytest.raises(PolicyError, match="expected the sizes of its layers and its weights"):
        event_director_of(f"{AND_EVENTS}nonsense")
    assert event_director_of("") is None
