"""What recorded flights teach a director of events, and the director of one search that learns it.

1. *A lesson* is the way of a recorded flight.  Until an event strikes the flight does not depend on
   it: a flight without the event shows what a director is shown at each decision at which it could
   have struck, and one with it shows that up to there.
2. *The response* says what follows a strike.  Nobody can compute that, so it is taken from the
   flights of this system in which an event struck: the mean of what followed, weighed by how alike
   the UAV's states are, and less if another kind of event struck.
3. *The weights* start from the fixed rule, and follow the gradient of what the response expects
   (:mod:`.gradient`), for each kind of event with weights of its own.
4. *The check*: few flights say little, and what looks best by them is often chance.  So two
   networks learn, each from every other flight with a strike, and each is measured by the flights
   that the other learned from.  Where both together are not worth more than the rule, the rule
   stays; else the mean of their weights decides.

In a search of 400 flights that takes some ten seconds of CPU, two percent of what the flights take.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.director import LearnedDirector
from pytest_garl.npcs.director_progress import AND_EVENTS, EventProgress, Outcome
from pytest_garl.npcs.event_watch import (
    AT,
    EVENT_FEATURES,
    EVENT_INPUTS,
    STRIKING,
    EventWatch,
    inputs,
)
from pytest_garl.npcs.gradient import Stopping, StoppingRate, learned_when_to_go
from pytest_garl.npcs.learned import Array, Network, network_from
from pytest_garl.npcs.own_director import mean, mean_worth
from pytest_garl.scenarios.groups import EVENTS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.events import Beginning
from pytest_garl.simulation.landing_moments import RecordedMoments
from pytest_garl.simulation.npc_policy import DECISION_STEP_S
from pytest_garl.simulation.strikes import outlooks_of

SURE = 4.0
"""The value of strike above wait by which the rule decides: a stopping probability of 98 %.  A
smaller one would stop most landings before they come to 3 m, and nothing would be learned of later
moments."""
MOST_FLIGHTS = 40
"""It learns from at most this many latest flights: a generation then takes a third of a second."""
MOST_STRIKES = 400
RATE = StoppingRate(imitates=0, steps=40, learning_rate=0.03, shrinks=1e-3)
LEAST_GAIN = 0.02
"""A kind of event strikes as it learned if that is worth more than the rule by this, else by the
rule."""
OTHER_EVENT = 0.2
"""Weight of what followed another kind of event in the same state."""
GUESS, GUESS_WEIGHT = 0.1, 2.0
"""Before any strike, this share of strikes is expected to violate, with the weight of two flights;
later the mean of all strikes takes the place of that guess."""
WIDTHS: Mapping[str, float] = {
    "height": 0.2,
    "from_marker": 0.2,
    "climb": 0.15,
    "speed": 0.3,
    "readable": 1.0,
    "passed_3_m": 1.0,
    "passed_touchdown": 0.5,
    "passed_lost": 1.0,
}
"""Two states that differ by this in one number count half for each other: 2 m, half a metre per
second, a metre per second; whether the marker can be read, and what has happened before."""
_COLUMNS = [AT[name] for name in WIDTHS]
_SCALES = np.array([*WIDTHS.values()])


def rule_network() -> Network:
    """Return the fixed rule as a network: each event strikes as soon as the UAV is below 3 m."""
    strike = np.zeros(EVENT_INPUTS)
    for number in range(len(EVENTS)):
        first = number * len(EVENT_FEATURES)
        strike[first + AT["always"]] = -SURE
        strike[first + AT["passed_3_m"]] = 2 * SURE
    weight = np.stack([np.zeros(EVENT_INPUTS), strike])
    return Network(state=STRIKING, layers=((weight, np.zeros(2)),))


def learned_kinds(director: str) -> frozenset[str]:
    """Return the kinds of events that strike as learned by a search's weights; others as ruled."""
    weights = director.partition(AND_EVENTS)[2]
    if not weights:
        return frozenset()
    found, rule = (each.layers[0][0] for each in (network_from(weights, STRIKING), rule_network()))
    own = np.flatnonzero((found != rule).any(axis=0)) // len(EVENT_FEATURES)
    return frozenset(EVENTS[number] for number in own)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EventLesson:
    """One flight: what was shown at each decision (n, features), and when events struck.

    ``struck`` has the number of the decision for each event that struck.
    """

    rows: Array
    struck: Mapping[str, int]
    outcome: Outcome

    @property
    def whole(self) -> Sequence[str]:
        """The events that did not strike: the flight shows all of their moments."""
        return [event for event in EVENTS if event not in self.struck]

    def waiting(self, event: str) -> Array:
        """Return what was shown while an event had not struck, (n, features)."""
        return self.rows[: self.struck.get(event, len(self.rows) - 1) + 1]


def lesson_of(scenario: Scenario, flight: Flight, outcome: Outcome) -> EventLesson | None:
    """Return what a flight teaches; None if it was too short for a decision."""
    watch = EventWatch()
    rows = [watch.look(outlook) for outlook in outlooks_of(flight)]
    if not rows:
        return None
    moments, struck = RecordedMoments(flight), {}
    for event in EVENTS:
        begins_s = Beginning(scenario, event, moments).time_s
        acts = any(key.startswith(f"{event}.") for key, _ in scenario.genes)
        if acts and begins_s < flight.elapsed_s:
            number = math.floor(begins_s / DECISION_STEP_S + 1e-6)
            struck[event] = min(number, len(rows) - 1)
    return EventLesson(rows=np.array(rows), struck=struck, outcome=outcome)


class EventResponse:
    """What follows when an event strikes in a state, by the flights in which one did."""

    def __init__(self) -> None:
        self._states = np.zeros((0, len(WIDTHS)))
        self._events: list[str] = []
        self._outcomes = np.zeros((0, 2))

    def learn(self, lesson: EventLesson) -> None:
        """Take in the strikes of a flight; the oldest ones are forgotten."""
        outcome = lesson.outcome
        for event, number in lesson.struck.items():
            state = lesson.rows[number, _COLUMNS] / _SCALES
            self._states = np.concatenate([self._states, state[None]])[-MOST_STRIKES:]
            self._events = [*self._events, event][-MOST_STRIKES:]
            row = np.array([[float(outcome.violates), outcome.worth]])
            self._outcomes = np.concatenate([self._outcomes, row])[-MOST_STRIKES:]

    def expected(self, rows: Array, event: str) -> Array:
        """Return the probability of a violation, and the worth, of strikes in states, (n, 2)."""
        known = len(self._events)
        total = self._outcomes.sum(axis=0) + GUESS_WEIGHT * GUESS
        mean = total / (known + GUESS_WEIGHT)
        likeness = np.zeros((len(rows), known))
        states = rows[:, _COLUMNS] / _SCALES
        for column in range(len(WIDTHS)):
            away = states[:, column][:, None] - self._states[:, column][None, :]
            likeness += away * away
        likeness = 1 / (1 + likeness)
        likeness *= np.where([each == event for each in self._events], 1.0, OTHER_EVENT)
        # In order, so that no BLAS adds them up.
        weighed = np.stack([(likeness * column).sum(axis=1) for column in self._outcomes.T], axis=1)
        found: Array = (weighed + GUESS_WEIGHT * mean) / (
            likeness.sum(axis=1)[:, None] + GUESS_WEIGHT
        )
        return found

    def thing(self, lesson: EventLesson, event: str) -> Stopping:
        """Return what each decision of a lesson is worth for an event."""
        rows = lesson.waiting(event)
        go = self.expected(rows, event)[:, 1]
        return Stopping(states=inputs(rows, event), go=go, never=0.0)


class OwnEventDirector:
    """Learns from generation after generation of one search when events should strike."""

    def __init__(self) -> None:
        self._rule = self.network = rule_network()
        self._response = EventResponse()
        self._halves = EventResponse(), EventResponse()
        """Each knows every other flight in which an event struck."""
        self._strikes = 0
        self._lessons: list[EventLesson] = []

    @property
    def text(self) -> str:
        """The weights, as a policy takes them; empty until an event struck."""
        return self.network.text if self._strikes else ""

    def learn(self, flights: Iterable[tuple[Scenario, Flight, Outcome]]) -> EventProgress:
        """Learn from the flights of a generation; return how good it was in them before."""
        found = (lesson_of(*flown) for flown in flights)
        return self.learn_lessons([lesson for lesson in found if lesson is not None])

    def learn_lessons(self, new: Sequence[EventLesson]) -> EventProgress:
        """Learn from the lessons of a generation; return how good it was in them before."""
        expected = 0.0
        for lesson in new:
            for event, number in lesson.struck.items():
                rows = lesson.rows[number : number + 1]
                expected += float(self._response.expected(rows, event)[0, 0])
        for lesson in new:
            self._response.learn(lesson)
            if lesson.struck:
                self._halves[self._strikes % 2].learn(lesson)
                self._strikes += 1
        whole = [self._response.thing(each, event) for each in new for event in each.whole]
        progress = EventProgress(
            flights=len(new),
            learned=_worth(self.network, whole),
            rule=_worth(self._rule, whole),
            best=mean([float(each.go.max()) for each in whole]),
            struck=sum(len(lesson.struck) for lesson in new),
            expected=expected,
            violated=sum(len(each.struck) for each in new if each.outcome.violates),
        )
        self._lessons = [*self._lessons, *new][-MOST_FLIGHTS:]
        if self._strikes:
            self.network = self._learned()
        return progress

    def _learned(self) -> Network:
        """Return what two halves of the flights agree on, kind by kind; else the rule."""
        things = [
            {event: [half.thing(each, event) for each in self._lessons] for event in EVENTS}
            for half in self._halves
        ]
        networks = [
            learned_when_to_go(
                self._rule,
                [each for event in EVENTS for each in own[event]],
                np.zeros(0),
                RATE,
                towards=self._rule.layers,
            )
            for own in things
        ]
        weight = self._rule.layers[0][0].copy()
        for number, event in enumerate(EVENTS):
            gains = [
                _worth(network, other[event]) - _worth(self._rule, other[event])
                for network, other in zip(networks, reversed(things), strict=True)
            ]
            if mean(gains) > LEAST_GAIN:
                own = slice(number * len(EVENT_FEATURES), (number + 1) * len(EVENT_FEATURES))
                (first, bias), (second, other_bias) = (each.layers[0] for each in networks)
                weight[:, own] = (first[:, own] + second[:, own]) / 2
                weight[:, own.start + AT["always"]] += (bias + other_bias) / 2
        return Network(state=STRIKING, layers=((weight, np.zeros(2)),))


def _worth(network: Network, things: Sequence[Stopping]) -> float:
    return mean_worth(LearnedDirector(network=network), things)
