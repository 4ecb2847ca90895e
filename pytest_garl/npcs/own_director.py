"""The director of one search: the weights that ship, trained on the system's own flights.

After each generation it learns from the lessons of all flights so far (:mod:`.lessons`): what each
decision would have been worth, by geometry and by how the system responded to NPCs that it saw.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from pytest_garl.airframe import Airframe
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.director import RULE, Director, LearnedDirector
from pytest_garl.npcs.director_progress import DirectorProgress
from pytest_garl.npcs.gradient import Stopping, StoppingRate, learned_when_to_go
from pytest_garl.npcs.learned import Network, learned_director
from pytest_garl.npcs.lessons import SINKS_MPS, Lesson, Response, lessons_of, sinking_mps
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario

MOST_LESSONS = 80
"""It learns from at most this many latest lessons: 20 generations then take 3 s."""
RATE = StoppingRate(imitates=0, steps=40, learning_rate=1e-3, shrinks=1e-2)


class OwnDirector:
    """Learns from generation after generation of one search."""

    def __init__(self, map: Map, airframe: Airframe) -> None:
        self._map, self._airframe = map, airframe
        shipped = learned_director().network
        assert isinstance(shipped, Network)
        self._shipped = self.network = shipped
        self._lessons: list[Lesson] = []
        self._response = Response()
        self._sinks_mps: list[float] = []

    @property
    def text(self) -> str:
        """The weights, as a policy takes them; empty if nothing was learned."""
        return self.network.text if self._lessons else ""

    def learn(self, flights: Iterable[tuple[Scenario, Flight]]) -> DirectorProgress:
        """Learn from the flights of a generation; return how good it was in them before."""
        flown = list(flights)
        self._sinks_mps += filter(None, (sinking_mps(flight) for _, flight in flown))
        sinks_mps = float(np.median(self._sinks_mps)) if self._sinks_mps else SINKS_MPS
        new = [
            lesson
            for scenario, flight in flown
            for lesson in lessons_of(flight, scenario, self._map, self._airframe, sinks_mps)
        ]
        seen = [(each.own, each.met) for each in new if each.own is not None]
        expected = [self._response.share(own) for own, _ in seen]
        for own, met in seen:
            self._response.learn(own, met)
        things = [each.worths(self._response) for each in new]
        progress = DirectorProgress(
            npcs=len(things),
            learned=mean_worth(LearnedDirector(network=self.network), things),
            shipped=mean_worth(LearnedDirector(network=self._shipped), things),
            rule=mean_worth(RULE, things),
            best=mean([max(each.never, float(each.go.max())) for each in things]),
            seen=len(seen),
            expected=_in_order(expected),
            met=sum(met for _, met in seen),
        )
        self._lessons = [*self._lessons, *new][-MOST_LESSONS:]
        if self._lessons:
            all_things = [each.worths(self._response) for each in self._lessons]
            self.network = learned_when_to_go(
                self._shipped, all_things, np.zeros(0), RATE, towards=self._shipped.layers
            )
        return progress


def mean_worth(director: Director, things: Sequence[Stopping]) -> float:
    """Return what a director's begins are worth in the mean."""
    worths = []
    for each in things:
        goes = (number for number, row in enumerate(each.states) if director.decides(row))
        number = next(goes, None)
        worths.append(each.never if number is None else float(each.go[number]))
    return mean(worths)


def mean(values: Sequence[float]) -> float:
    """Return the mean, 0 of nothing."""
    return _in_order(values) / len(values) if values else 0.0


def _in_order(values: Sequence[float]) -> float:
    total = 0.0
    for each in values:
        total += each
    return total
