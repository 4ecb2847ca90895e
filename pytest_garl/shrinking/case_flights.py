"""Flights for one case request: flown on demand, counted, within the request's budget."""

from __future__ import annotations

import dataclasses

from pytest_garl.cases.case import NOT_ASKED, Case, Prevention, RecordedBehaviour
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.execution.severity_of_flight import idle_groups
from pytest_garl.flight.flight_file import load
from pytest_garl.scenarios.conditions import without_groups
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult, FailingScenario
from pytest_garl.shrinking.move_reduction import shortened
from pytest_garl.shrinking.plan import ESCAPE_FLIGHTS, NEIGHBOURS, Step
from pytest_garl.shrinking.prevention import collision_of, prevention_of
from pytest_garl.shrinking.robustness import neighbours
from pytest_garl.shrinking.simplification import (
    genome_of_scenario,
    removals,
    simplified,
    value_simplifications,
)
from pytest_garl.simulation.npc_policy import PolicySpec


class CaseFlights:
    """Flies scenarios for one case request and counts the flights.

    Objects either follow the search's policy ("live") or repeat recorded moves.
    """

    def __init__(self, request: CaseRequest, fly: FlyFunction) -> None:
        self.request = request
        self.flown = 0
        self.asked_prevention = False
        self._fly = fly
        self._live: dict[Scenario, CompletedFlight] = dict(request.violations)
        self._of_search = {*self._live}
        self._origins: dict[Scenario, Scenario] = {}
        self._flown: set[Scenario] = set()
        self._failed: list[Scenario] = []

    @property
    def map(self) -> Map:
        """The map of all scenarios."""
        return self.request.map

    @property
    def left(self) -> int:
        """The flights that remain, without those that are kept to confirm an escape."""
        kept = ESCAPE_FLIGHTS if self.request.asks_prevention else 0
        return self.request.budget - kept - self.flown

    def suffice_for(self, step: Step) -> bool:
        """Return whether as many flights are left as a step takes and keeps."""
        return self.left >= step.needs

    def live_flight(self, scenario: Scenario) -> CompletedFlight:
        """Return the flight of a scenario that the search or :meth:`fly_live` has flown."""
        return self._live[scenario]

    def live_behaviour(self, scenario: Scenario) -> RecordedBehaviour:
        """Return what the objects did in the live flight of a scenario, in few digits."""
        return shortened(recorded_behaviour(self._live[scenario], scenario, self.map))

    def without_idle(self, scenario: Scenario) -> Scenario:
        """Return a violation of the search without the conditions whose data was never read.

        Its flight is the same, so nothing is flown.
        """
        flight = self._live[scenario]
        found = without_idle(self.request, scenario, flight)
        if found != scenario:
            self._live[found] = flight
            self._of_search.add(found)
            self._origins[found] = scenario
        return found

    def as_found(self, failing: FailingScenario) -> FailingScenario:
        """Return a failure with the scenario of the search, all its conditions included."""
        origin = self._origins.get(failing.origin, failing.origin)
        return dataclasses.replace(failing, origin=origin)

    def untried(self, failing: FailingScenario) -> tuple[str, ...]:
        """Return the conditions and objects of which no flight showed whether they are needed.

        A flight shows that if it lacks nothing but them of a scenario that failed.
        """
        scenario, map = failing.scenario, self.map
        hit = find_colliding_object(failing.flight)
        known = dict.fromkeys((scenario, *self._failed))
        names = []
        for name, steps in removals(scenario, map, hit).items():
            ways = [[step] for step in steps] + ([steps] if len(steps) > 1 else [])
            without = (repair(simplified(each, way), map) for each in known for way in ways)
            if self._flown.isdisjoint(without):
                names.append(name)
        values = value_simplifications(scenario, genome_of_scenario(scenario, map))
        for cause, steps in values.items():
            without = (repair(step(each), map) for each in known for step in steps)
            if cause not in names and self._flown.isdisjoint(without):
                names.append(f"each value of {cause}")
        return tuple(names)

    def fly_live(self, scenario: Scenario) -> CompletedFlight:
        """Fly a scenario with the search's policy."""
        flight = self._live[scenario] = self._go(self.request.job, scenario)
        return flight

    def fly_moved_by(self, scenario: Scenario, npcs: PolicySpec) -> CompletedFlight:
        """Fly a scenario with another policy than the search's."""
        return self._go(dataclasses.replace(self.request.job, npcs=npcs), scenario)

    def fly_recorded(self, scenario: Scenario, behaviour: RecordedBehaviour) -> CompletedFlight:
        """Fly a scenario in which the objects repeat recorded moves."""
        return self.fly_moved_by(scenario, behaviour.policy)

    def fails_live(self, scenario: Scenario) -> bool:
        """Fly a scenario with the search's policy; return whether it fails in the same way."""
        return self._fails(scenario, self.fly_live(scenario))

    def fails_recorded(self, scenario: Scenario, behaviour: RecordedBehaviour) -> bool:
        """Fly a scenario with recorded moves; return whether it fails in the same way."""
        return self._fails(scenario, self.fly_recorded(scenario, behaviour))

    def confirm(
        self,
        origin: Scenario,
        scenario: Scenario,
        behaviour: RecordedBehaviour,
        *,
        at_least: int = 0,
    ) -> FailingScenario | None:
        """Fly a scenario and its neighbours with recorded moves.

        Returns None if the scenario does not fail, or if fewer than ``at_least`` neighbours fail.
        """
        flight = self._known_flight(scenario, behaviour) or self.fly_recorded(scenario, behaviour)
        if not self._fails(scenario, flight):
            return None
        failing = self.count_neighbours(origin, scenario, behaviour, flight, at_least=at_least)
        return failing if failing.neighbours_failed >= at_least else None

    def to_confirm(self, scenario: Scenario, behaviour: RecordedBehaviour) -> int:
        """Return how many flights :meth:`confirm` takes at most."""
        return NEIGHBOURS + (self._known_flight(scenario, behaviour) is None)

    def _known_flight(
        self, scenario: Scenario, behaviour: RecordedBehaviour
    ) -> CompletedFlight | None:
        """Return the live flight of a scenario if nothing moved in it: it is the recorded one.

        A flight of the search is no confirmation.
        """
        if behaviour.moves or scenario in self._of_search:
            return None
        return self._live.get(scenario)

    def count_neighbours(
        self,
        origin: Scenario,
        scenario: Scenario,
        behaviour: RecordedBehaviour,
        flight: CompletedFlight,
        *,
        at_least: int = 0,
    ) -> FailingScenario:
        """Return a scenario that failed in ``flight``, with the number of neighbours that fail.

        Stops flying when fewer than ``at_least`` can fail.
        """
        failed = NEIGHBOURS
        for each in neighbours(scenario, self.map):
            failed -= not self.fails_recorded(each, behaviour)
            if failed < at_least:
                break
        return FailingScenario(
            origin=origin,
            scenario=scenario,
            behaviour=behaviour,
            flight=flight,
            neighbours_failed=failed,
            neighbours_flown=NEIGHBOURS,
        )

    def prevention(self, failing: FailingScenario) -> Prevention:
        """Return whether the collision of a failing scenario could have been prevented."""
        self.asked_prevention = True
        request = self.request
        if not request.asks_prevention:
            return NOT_ASKED
        job = dataclasses.replace(request.job, npcs=failing.npcs or request.job.npcs)
        collision = collision_of(
            job, failing.scenario, failing.behaviour, failing.flight, request.map
        )
        if collision is None:
            return NOT_ASKED
        flights = min(ESCAPE_FLIGHTS, request.budget - self.flown)
        return prevention_of(collision, lambda job: self._go(job, failing.scenario), flights)

    def result(self, case: Case | None, reason: str = "") -> CaseResult:
        """Return the end of the investigation, with the flights that it took."""
        return CaseResult(
            signature=self.request.signature,
            case=case,
            flights=self.flown,
            reason=reason,
        )

    def _fails(self, scenario: Scenario, flight: CompletedFlight) -> bool:
        if not self.request.fails(scenario, flight):
            return False
        self._failed.append(scenario)
        return True

    def _go(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        self.flown += 1
        self._flown.add(scenario)
        return self._fly(job, scenario)


def without_idle(request: CaseRequest, scenario: Scenario, flight: CompletedFlight) -> Scenario:
    """Return a scenario without the conditions that cannot have acted.

    They change only data which was never read, or are events that did not strike.  ``flight`` is
    its flight.  The other scenario has the same one; the assertion of a test may judge it in
    another way.
    """
    if not flight.record.exists():
        return scenario
    found = without_groups(scenario, idle_groups(scenario, load(flight.record)))
    return found if request.fails(found, flight) else scenario


def recorded_behaviour(flight: CompletedFlight, scenario: Scenario, map: Map) -> RecordedBehaviour:
    """Return what each object did in a flight, exactly; no moves if the flight left no record."""
    names = [name for name, _ in map.without(scenario.removed_objects).present_objects]
    if not flight.record.exists():
        return RecordedBehaviour(moves=tuple((name, ()) for name in names))
    objects = load(flight.record).objects
    made = {item.name: item.moves for item in objects}
    return RecordedBehaviour(
        moves=tuple(
            (name, tuple((float(x), float(y)) for x, y in made.get(name, ()))) for name in names
        ),
        changes=tuple((item.name, item.changes) for item in objects if item.changes),
    )


def find_colliding_object(flight: CompletedFlight) -> str:
    """Return the moving object that the UAV hit; empty if it hit none."""
    hit, kind = flight.result.collisions, flight.result.verdict.violation_type
    return hit[-1] if hit and kind == "IV" else ""
