"""The directors of one search: that of NPCs and that of events, which learn from its flights."""

from __future__ import annotations

from collections.abc import Sequence

from pytest_garl.airframe import Airframe
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.director_progress import AND_EVENTS, Outcome, Progress
from pytest_garl.npcs.event_lessons import OwnEventDirector
from pytest_garl.npcs.own_director import OwnDirector
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario


class SearchDirectors:
    """Learn from generation after generation of one search."""

    def __init__(self, map: Map, airframe: Airframe) -> None:
        self._npcs, self._events = OwnDirector(map, airframe), OwnEventDirector()

    @property
    def text(self) -> str:
        """The weights of both, as a policy takes them; empty if nothing was learned."""
        events = self._events.text
        return f"{self._npcs.text}{AND_EVENTS}{events}" if events else self._npcs.text

    def learn(self, flights: Sequence[tuple[Scenario, Flight, Outcome]]) -> Progress:
        """Learn from the flights of a generation; return how good both were in them before."""
        return Progress(
            npcs=self._npcs.learn((scenario, flight) for scenario, flight, _ in flights),
            events=self._events.learn(flights),
        )
