"""When events strike that wait for a decision: a director decides in flight, every half second.

It is shown what an adversary sees from outside: how the UAV moves, and whether the marker can be
read; nothing of what the landing system thinks.  A decision is noted as a time after the latest
moment of the landing (:mod:`.landing_moments`), and counts as that in the flight itself: a scenario
that names moment and time flies to the byte as this one did, and needs no director.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Collection, Iterator, Sequence

from pytest_garl.flight.detectability import READABLE, readable_probability
from pytest_garl.flight.flight import Flight, MarkerView
from pytest_garl.scenarios.groups import MOMENTS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.landing_moments import LandingMoments, RecordedMoments
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, EventDirector, Outlook

Vector = tuple[float, float, float]
AT_3_M = MOMENTS.index("3 m")


class AtThreeMetres:
    """The fixed rule: all events strike as soon as the UAV has sunk past 3 m."""

    def strikes(self, outlook: Outlook, waiting: Sequence[str]) -> Collection[str]:
        """Return all events once the UAV is below 3 m."""
        return waiting if math.isfinite(outlook.moments_s[AT_3_M]) else ()


class Strikes:
    """The events of one flight that wait for a decision; without a director the rule decides."""

    def __init__(
        self, scenario: Scenario, moments: LandingMoments, director: EventDirector | None
    ) -> None:
        self._waiting = scenario.decided_events
        self._moments, self._director = moments, director or AtThreeMetres()

    def decide(
        self,
        time_s: float,
        uav_m: Vector,
        uav_mps: Vector,
        marker_m: tuple[float, float],
        view: MarkerView | None,
    ) -> None:
        """Ask the director whether events strike; ``view`` is the latest picture's."""
        if not self._waiting:
            return
        outlook = Outlook(
            time_s=time_s,
            uav_position_m=uav_m,
            uav_velocity_mps=uav_mps,
            marker_position_m=marker_m,
            moments_s=self._moments.began_s,
            is_readable=readable_probability(view) >= READABLE,
        )
        struck = self._director.strikes(outlook, self._waiting)
        for event in struck:
            self._moments.strike(event, time_s)
        self._waiting = tuple(each for each in self._waiting if each not in struck)


def outlooks_of(flight: Flight, until_s: float = math.inf) -> Iterator[Outlook]:
    """Yield what a director would have been shown at each decision of a recorded flight."""
    moments, track = RecordedMoments(flight), flight.uav
    samples = {round(float(time_s), 6): row for row, time_s in enumerate(track.time_s)}
    times = [step.time_s for step in flight.steps]
    for number in range(math.floor(min(until_s, flight.elapsed_s) / DECISION_STEP_S) + 1):
        time_s = number * DECISION_STEP_S
        row = samples.get(round(time_s, 6))
        if row is None:
            # The record of a simulator with other samples, or its end.
            return
        x, y, z = track.position_m[row].tolist()
        vx, vy, vz = track.velocity_mps[row].tolist()
        # A decision falls before the pictures of its time.
        got = bisect.bisect_left(times, time_s)
        view = flight.steps[got - 1].marker if got else None
        yield Outlook(
            time_s=time_s,
            uav_position_m=(x, y, z),
            uav_velocity_mps=(vx, vy, vz),
            marker_position_m=flight.marker_position_m,
            moments_s=moments.known_at(time_s),
            is_readable=readable_probability(view) >= READABLE,
        )
