"""What a recorded flight teaches a director: what to go at each decision would have been worth.

Up to the first picture that shows an NPC under way the UAV's way does not depend on when the NPC
begins: up to there geometry tells whether they meet.  Beyond it the UAV is taken to sink straight
down, as it does if it takes no notice; how often it then comes as forecast is what
:class:`Response` learns from the flights in which it happened.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pytest_garl.airframe import Airframe
from pytest_garl.flight.flight import Flight, Track
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.npcs.decision_rules import Intercepting
from pytest_garl.npcs.director import GRADES, NEAR_M, TimeToGo
from pytest_garl.npcs.encounter import (
    COLLISION_WORTH,
    PREVENTABLE_WORTH,
    Encounter,
    Passage,
    could_be_prevented,
)
from pytest_garl.npcs.gradient import Stopping
from pytest_garl.npcs.interference import Interfering
from pytest_garl.npcs.learned import Array
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import story_of
from pytest_garl.simulation.landing_moments import HEIGHTS_M, RecordedMoments
from pytest_garl.simulation.npc_policy import DECISION_STEP_S

AROUND = TimeToGo(margin_s=0.5, unseen_s=1.0)
"""The begin in whose neighbourhood most NPCs can meet the UAV."""
ASKED = (-8, -4, -1, 2, 5)
"""The decisions of a flight that are asked about, from :data:`AROUND` on, in half seconds; those
between them are worth what lies between, and those outside nothing."""
SINKS_MPS = 0.5
"""How fast a UAV sinks of which nothing is known."""
STEADY_S = 2.0
"""The speed of a UAV is that of its last two seconds."""
STEP_S = 0.1
NEAR_MISS_M = 3.0
"""An NPC that comes this near, and no nearer, is worth nothing."""
NEAR_MISS_WORTH = 0.05
"""Worth of an NPC that nearly meets the UAV: the smallest margin decides where nothing happens."""
KINDS = ("they meet unseen", "they meet in view", "they do not meet")
"""What geometry forecasts; "in view" is long enough for the UAV to escape."""
UNSEEN, IN_VIEW, APART = range(3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Forecast:
    """What geometry says of one begin: one of :data:`KINDS`, and how near they come.

    ``is_certain`` is whether it does not depend on what the UAV does once it sees the NPC.
    """

    kind: int
    nearest_m: float
    is_certain: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lesson:
    """One NPC in one flight: its numbers at each decision (n, features), and some forecasts.

    ``asked`` are the numbers of the decisions that ``forecasts`` are about.  ``own`` is the
    forecast of the begin that was flown, and ``met`` whether they met in flight; ``own`` is None if
    the NPC never began, or the UAV never saw it.
    """

    states: Array
    asked: tuple[int, ...]
    forecasts: tuple[Forecast, ...]
    own: Forecast | None
    met: bool

    def worths(self, response: Response) -> Stopping:
        """Return what each decision is worth, by what is known of how the UAV responds."""
        worths = [response.worth(each) for each in self.forecasts]
        numbers = np.arange(len(self.states))
        go = np.interp(numbers, self.asked, worths, left=0.0, right=0.0)
        return Stopping(states=self.states, go=go, never=0.0)


class Response:
    """How often an NPC meets the UAV, for each forecast, in the flights in which the UAV saw it.

    Before the first such flight it is :data:`FIRST_GUESS`, which weighs as much as two flights.
    """

    FIRST_GUESS = (0.75, 0.5, 0.05)

    def __init__(self) -> None:
        self._met, self._all = [0, 0, 0], [0, 0, 0]

    def share(self, forecast: Forecast) -> float:
        """Return the probability that they meet."""
        if forecast.is_certain:
            return float(forecast.kind != APART)
        met, count = self._met[forecast.kind], self._all[forecast.kind]
        return (met + 2 * self.FIRST_GUESS[forecast.kind]) / (count + 2)

    def worth(self, forecast: Forecast) -> float:
        """Return what a begin is worth."""
        share = self.share(forecast)
        meeting = PREVENTABLE_WORTH if forecast.kind == IN_VIEW else COLLISION_WORTH
        near = max(0.0, 1 - forecast.nearest_m / NEAR_MISS_M)
        return share * meeting + (1 - share) * NEAR_MISS_WORTH * near

    def learn(self, forecast: Forecast, met: bool) -> None:
        """Take in what happened in a flight."""
        self._met[forecast.kind] += met
        self._all[forecast.kind] += 1


def sinking_mps(flight: Flight) -> float | None:
    """Return how fast a UAV sank from 8 to 3 m; None if it did not."""
    began_s = RecordedMoments(flight).began_s
    high_s, low_s = began_s[1], began_s[2]
    if not math.isfinite(low_s) or low_s - high_s < STEP_S:
        return None
    return (HEIGHTS_M[0] - HEIGHTS_M[1]) / (low_s - high_s)


def lessons_of(
    flight: Flight, scenario: Scenario, map: Map, airframe: Airframe, sinks_mps: float
) -> Iterator[Lesson]:
    """Yield a lesson for each NPC of a flight that sees the UAV in part.

    ``sinks_mps`` is how fast this landing system sinks, if the flight does not tell.
    """
    placed = Placed(scenario, map)
    for name, _ in placed.map.present_objects:
        story = story_of(scenario, name)
        if story is None or story.grade not in GRADES or placed.npc(name).speed_mps <= 0:
            continue
        began_s = story.begins_s(RecordedMoments(flight).of_npc(name))
        seen = (each.time_s for each in flight.steps if name in each.objects_visible)
        seen_s = next((time_s for time_s in seen if time_s >= began_s), None)
        met_s = _contact_s(flight, name)
        known_s = min(
            _end_s(flight), *(math.inf if each is None else each for each in (seen_s, met_s))
        )
        way = _undisturbed(flight, known_s, seen_s is not None or met_s is not None, sinks_mps)
        if len(way.time_s) < 2:
            continue
        policy = functools.partial(Interfering, story.grade, Intercepting())
        with Passage(way, scenario, placed.map, name, airframe, policy) as passage:
            states = np.array(passage.waiting())
            asked = _asked(states)
            found = [passage.begin_at(number * DECISION_STEP_S) for number in asked]
            own = None
            if seen_s is not None and began_s <= float(way.time_s[-1]):
                began = math.ceil(began_s / DECISION_STEP_S - 1e-9)
                own = _forecast(passage.begin_at(began * DECISION_STEP_S))
        yield Lesson(
            states=states,
            asked=asked,
            forecasts=tuple(_forecast(each, known_s) for each in found),
            own=own,
            met=met_s is not None,
        )


def _forecast(encounter: Encounter, known_s: float | None = None) -> Forecast:
    """Return what geometry says of an encounter; ``known_s`` is up to when the way is that flown.

    Without it nothing is certain.
    """
    contact_s, seen_s = encounter.contact_s, encounter.seen_s
    kind = APART
    if contact_s is not None:
        kind = IN_VIEW if could_be_prevented(contact_s, seen_s) else UNSEEN
    return Forecast(
        kind=kind,
        nearest_m=encounter.nearest_m,
        is_certain=known_s is not None and encounter.meets(known_s) is not None,
    )


def _end_s(flight: Flight) -> float:
    """Return when the UAV stands: after that there is no contact that counts."""
    touchdown = flight.touchdown
    return touchdown.time_s if touchdown is not None else flight.elapsed_s


def _contact_s(flight: Flight, name: str) -> float | None:
    contact = flight.contacts[-1] if flight.contacts else None
    if flight.outcome != "collision" or contact is None or contact.body != name:
        return None
    return contact.time_s


def _undisturbed(flight: Flight, until_s: float, goes_on: bool, sinks_mps: float) -> Track:
    """Return the recorded way up to a time, from where the UAV sinks straight down if it goes on.

    One that is not above the marker by then does not: nobody knows how it would have come there.
    """
    uav = flight.uav
    count = int(np.searchsorted(uav.time_s, until_s + 1e-6, side="right"))
    times, places = uav.time_s[:count], uav.position_m[:count]
    known = Track(
        time_s=times,
        position_m=places,
        attitude=uav.attitude[:count],
        velocity_mps=uav.velocity_mps[:count],
    )
    if not goes_on or count < 2:
        return known
    now, (x, y, z) = float(times[-1]), places[-1].tolist()
    if math.dist((x, y), flight.marker_position_m) > NEAR_M:
        return known
    first = int(np.searchsorted(times, now - STEADY_S))
    fell_m, took_s = float(places[first, 2]) - z, now - float(times[first])
    sinks_mps = max(fell_m / took_s if took_s > 0 else 0.0, sinks_mps)
    steps = max(0, math.ceil(feet_height_m(z) / sinks_mps / STEP_S))
    later = STEP_S * np.arange(1, steps + 1)
    straight = np.repeat(np.array([[x, y, z]]), steps, axis=0)
    straight[:, 2] -= np.minimum(later * sinks_mps, feet_height_m(z))
    falls = np.repeat(np.array([[0.0, 0.0, -sinks_mps]]), steps, axis=0)
    level = np.repeat(known.attitude[-1:], steps, axis=0)
    return Track(
        time_s=np.concatenate([times, now + later]),
        position_m=np.concatenate([places, straight]),
        attitude=np.concatenate([known.attitude, level]),
        velocity_mps=np.concatenate([known.velocity_mps, falls]),
    )


def _asked(states: Array) -> tuple[int, ...]:
    """Return the decisions that are asked about."""
    last = len(states) - 1
    goes = (number for number, row in enumerate(states) if AROUND.decides(row))
    middle = next(goes, last)
    return tuple(sorted({min(last, max(0, middle + offset)) for offset in ASKED}))
