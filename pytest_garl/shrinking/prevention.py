"""Prevention: could a collision with a moving body have been escaped, and was it in view in time.

A model plans an escape from the flight's own state, later and later before the contact; a real
flight confirms the plan: the landing system flies until then, the escape after it.  NPCs repeat
their moves until then; after it a policy that reads the UAV goes on live.  A UAV that stands on the
ground escapes by stopping its motors as well: then a body that runs into it is no violation.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from pytest_garl.cases.case import (
    ESCAPE_STEP_S,
    LONGEST_ESCAPE_S,
    NOT_ASKED,
    REACTION_S,
    Prevention,
    RecordedBehaviour,
)
from pytest_garl.cases.observability import first_observation_s
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.fly_and_judge import time_limit_s
from pytest_garl.execution.job import FlightJob
from pytest_garl.flight.flight import Contact, Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import Airframe, airframe_of
from pytest_garl.npcs.recorded import handed_over_spec
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.clearance import escaped, world_of
from pytest_garl.shrinking.escape_model import Chase, EscapeModel
from pytest_garl.shrinking.escape_plan import HOVERS_S, find_escape
from pytest_garl.simulation.land_detector import DETECTED_AFTER_S
from pytest_garl.simulation.landing_moments import RecordedMoments
from pytest_garl.simulation.navigation import error_m_at
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ, World
from pytest_garl.simulation.system_under_test.takeover import Leg, Pilot, Takeover
from pytest_garl.verdicts.evidence import Evidence

STEADY_S = 1.0
"""From this time after its touchdown on, a UAV that is still on the ground may stop its motors: the
land detector waits for the same second."""
EXTRA_S = 0.5
"""The flight of an escape goes on for this time after it is judged."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Collision:
    """A flight that ended in a collision with a moving body, and how to fly it again."""

    job: FlightJob
    scenario: Scenario
    behaviour: RecordedBehaviour
    flight: Flight
    contact: Contact
    map: Map
    airframe: Airframe

    @property
    def until_s(self) -> float:
        """The time until which an escape must hold."""
        return min(self.contact.time_s + HOVERS_S, time_limit_s(self.job.limits))

    def npcs(self, from_s: float) -> PolicySpec:
        """Return the policy that moves the objects if another pilot takes over at a time."""
        recorded = self.behaviour.policy
        if not self.job.npcs.reads_uav:
            return recorded
        return handed_over_spec(recorded, self.job.npcs, from_s)

    def takeover_s(self, before_s: float) -> float:
        """Return when the first command takes effect from a time before the contact on."""
        airframe = self.airframe
        wanted = self.contact.time_s - before_s
        frame = max(1, round(PHYSICS_RATE_HZ / airframe.camera.rate_hz))
        late = round(airframe.latency_s * PHYSICS_RATE_HZ)
        first = math.ceil((wanted * PHYSICS_RATE_HZ - late) / frame - 1e-6)
        return (first * frame + late) / PHYSICS_RATE_HZ

    def job_of(
        self,
        pilot: Pilot,
        from_s: float,
        legs: tuple[Leg, ...] = (),
    ) -> FlightJob:
        """Return the job of the same flight in which another pilot takes over."""
        takeover = Takeover(
            pilot=pilot,
            from_s=from_s,
            until_s=self.until_s + EXTRA_S,
            legs=legs,
            marker_m=self._believed_marker_m(from_s)
            if pilot == "blind"
            else self.flight.marker_position_m,
        )
        return dataclasses.replace(self.job, npcs=self.npcs(from_s), takeover=takeover)

    def _believed_marker_m(self, time_s: float) -> tuple[float, float]:
        """Return the marker's place in the frame of the UAV's own estimate at a time."""
        x, y = self.flight.marker_position_m
        dx, dy, _ = error_m_at(self.scenario, time_s, RecordedMoments(self.flight))
        return x + dx, y + dy

    def model(self, from_s: float, world: World) -> EscapeModel:
        """Return the model of an escape from a time on."""
        chase = Chase(
            flight=self.flight,
            scenario=self.scenario,
            map=self.map,
            airframe=self.airframe,
            npcs=self.npcs(from_s),
            world=world,
        )
        return EscapeModel(chase, from_s)

    @contextmanager
    def world(self) -> Iterator[World]:
        """Yield the bodies of the flight, to measure distances."""
        with world_of(self.flight, self.map, self.airframe) as world:
            yield world

    def observation_s(self) -> float | None:
        """Return when the body was first observable within the time of the earliest escape."""
        since_s = self.contact.time_s - LONGEST_ESCAPE_S - REACTION_S
        return first_observation_s(self.flight, self.contact.body, since_s)

    def stood_since_s(self) -> float | None:
        """Return since when the UAV had stood on the ground at the contact; None in the air."""
        found = Evidence(self.flight).stays
        return found[-1].since_s if found and found[-1].end_s is None else None

    def survives(self, completed: CompletedFlight, from_s: float, world: World) -> bool:
        """Return whether a flight with a takeover is the same until then, and escapes."""
        if not completed.record.exists():
            return False
        flight = load(completed.record)
        return self.same_until(flight, from_s) and escaped(flight, world, from_s, self.until_s)

    def stops(self, completed: CompletedFlight, from_s: float) -> bool:
        """Return whether a flight with a takeover is the same until then, and lands in time."""
        if not completed.record.exists():
            return False
        flight = load(completed.record)
        return self.same_until(flight, from_s) and flight.outcome == "landed"

    def same_until(self, flight: Flight, time_s: float) -> bool:
        """Return whether another flight has the same trajectory up to a time."""
        count = int(np.searchsorted(self.flight.uav.time_s, time_s, side="right"))
        own, other = self.flight.uav.position_m[:count], flight.uav.position_m[:count]
        return np.array_equal(own, other)


def collision_of(
    job: FlightJob,
    scenario: Scenario,
    behaviour: RecordedBehaviour,
    completed: CompletedFlight,
    map: Map,
) -> Collision | None:
    """Return a flight's collision with a moving body; None for any other flight."""
    if completed.result.outcome != "collision" or not completed.record.exists():
        return None
    flight = load(completed.record)
    contact = flight.contacts[-1] if flight.contacts else None
    recorded = {item.name: item.type for item in flight.objects}
    # A user's own simulator may record no objects, or others.
    present = Placed(scenario, map).map
    if contact is None or contact.body not in recorded or recorded != dict(present.present_objects):
        return None
    try:
        airframe = airframe_of(job.system.load())
    except (ImportError, LandingSystemError):
        return None
    return Collision(
        job=job,
        scenario=scenario,
        behaviour=behaviour,
        flight=flight,
        contact=contact,
        map=present,
        airframe=airframe,
    )


Fly = Callable[[FlightJob], CompletedFlight]


def prevention_of(collision: Collision, fly: Fly, flights: int) -> Prevention:
    """Return whether a collision could have been prevented; fly at most ``flights`` flights.

    If no planned escape is confirmed within these flights, it returns ``NOT_ASKED``.
    """
    with collision.world() as world:
        return _Question(collision, world, fly, flights).answer()


class _Question:
    """Searches the latest escape, then one from the state shortly after the first observation."""

    def __init__(self, collision: Collision, world: World, fly: Fly, flights: int) -> None:
        self._collision, self._world = collision, world
        self._fly, self._left = fly, flights
        self._unconfirmed = False

    def answer(self) -> Prevention:
        contact_s = self._collision.contact.time_s
        seen_s = self._collision.observation_s()
        observed_s = None if seen_s is None else round(contact_s - seen_s, 3)
        tried = [ESCAPE_STEP_S * (1 + n) for n in range(round(LONGEST_ESCAPE_S / ESCAPE_STEP_S))]
        tried = [before_s for before_s in tried if before_s < contact_s]
        stop_s = next((before_s for before_s in tried if self._stops(before_s)), None)
        latest_s = next(
            (before_s for before_s in tried if before_s == stop_s or self._escapes(before_s)), None
        )
        if latest_s is None:
            if self._unconfirmed or not tried:
                return NOT_ASKED
            return Prevention(answer="unpreventable", inevitable_s=tried[-1], observed_s=observed_s)
        if stop_s is not None:
            # It stands there and need not have seen anything.
            return Prevention(
                answer="preventable",
                inevitable_s=latest_s - ESCAPE_STEP_S,
                observed_s=observed_s,
                escape="motors off",
            )
        ready_s = 0.0 if seen_s is None else contact_s - seen_s - REACTION_S
        # A UAV that has an escape later can also wait for it.
        in_time = ready_s >= latest_s or (ready_s > 0 and self._escapes(ready_s))
        return Prevention(
            answer="preventable" if in_time else "sensor-limited",
            inevitable_s=latest_s - ESCAPE_STEP_S,
            observed_s=observed_s,
        )

    def _escapes(self, before_s: float) -> bool:
        """Return whether a planned escape is confirmed from a time before the contact."""
        collision = self._collision
        from_s = collision.takeover_s(before_s)
        if from_s >= collision.contact.time_s:
            return False
        model = collision.model(from_s, self._world)
        legs = find_escape(model, collision.contact.body, collision.contact.time_s)
        if legs is None:
            return False
        completed = self._flown(collision.job_of("escape", from_s, legs))
        confirmed = completed is not None and collision.survives(completed, from_s, self._world)
        self._unconfirmed |= not confirmed
        return confirmed

    def _stops(self, before_s: float) -> bool:
        """Return whether a UAV that stands on the ground can stop its motors before the contact."""
        collision = self._collision
        from_s, since_s = collision.takeover_s(before_s), collision.stood_since_s()
        if since_s is None or from_s < since_s + STEADY_S:
            return False
        # One flight is left for an escape by flying.
        if self._left <= 1 or from_s + DETECTED_AFTER_S >= collision.contact.time_s:
            return False
        completed = self._flown(collision.job_of("stop", from_s))
        return completed is not None and collision.stops(completed, from_s)

    def _flown(self, job: FlightJob) -> CompletedFlight | None:
        """Fly a job; return None if no flight is left for it."""
        if not self._left:
            return None
        self._left -= 1
        return self._fly(job)
