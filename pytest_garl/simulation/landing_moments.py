"""The moments of a landing that stories of NPCs and events wait for, as they come in a flight."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from pytest_garl.flight.detectability import READABLE, readable_probability
from pytest_garl.flight.flight import Flight, MarkerView
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.scenarios.groups import DECIDED, MOMENTS, QUANTITIES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import (
    MET,
    STORY,
    STORY_MOMENTS,
    story_of,
    waits_for_decision,
)
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, PolicySpec

HEIGHTS_M = (8.0, 3.0, 0.1)
"""Heights of the feet above the ground that begin the moments after the start."""
DESCENT_HYSTERESIS_M = 0.5
"""A UAV sinks past a height if it was higher by this: it takes off from below."""
LOST_AFTER_S = 0.5
"""A marker is lost if no picture for half a second could be read: one bad picture is no loss."""
OF_PICTURES = ("readable", "lost")
"""The moments that pictures tell, and no height."""
_READABLE_AT, _LOST_AT = (MOMENTS.index(name) for name in OF_PICTURES)
_LONG_S = 100.0
"""A time from here on is written in hundredths of a second, a shorter one in milliseconds."""


class LandingMoments:
    """Notes when each of ``MOMENTS`` came for the first time; infinite if it has not.

    A UAV that was never above a height has sunk past it when it sinks past the next one.  A picture
    counts when the landing system gets it; who flies a record again without pictures gives the
    moments of that record.
    """

    def __init__(self, recorded: Iterable[tuple[str, float]] = ()) -> None:
        self._peak_m = 0.0
        self._last_readable_s = math.inf
        self._began_s = [0.0, *(math.inf for _ in MOMENTS[1:])]
        self._struck_s: dict[str, float] = {}
        self._recorded = [(name, time_s) for name, time_s in recorded if name in OF_PICTURES]

    @property
    def began_s(self) -> tuple[float, ...]:
        """When each moment came."""
        return tuple(self._began_s)

    def of_event(self, name: str) -> tuple[float, ...]:
        """Return when each moment came for which an event may wait."""
        return (*self._began_s, self._struck_s.get(name, math.inf))

    def strike(self, event: str, time_s: float) -> None:
        """Note the decision that an event strikes now.

        That is a time after the latest moment, in digits that a scenario holds, and so as soon as
        these allow.
        """
        number, delay_s = _after_latest(self._began_s, time_s)
        self._struck_s[event] = self._began_s[number] + delay_s

    def update(self, time_s: float, height_m: float) -> None:
        """Take in the height of the feet above the ground."""
        self._peak_m = max(self._peak_m, height_m)
        for number, limit_m in enumerate(HEIGHTS_M, start=1):
            if height_m <= limit_m <= self._peak_m - DESCENT_HYSTERESIS_M:
                for each in range(1, number + 1):
                    self._began_s[each] = min(self._began_s[each], time_s)
        for name, came_s in self._recorded:
            if came_s <= time_s:
                self._began_s[MOMENTS.index(name)] = came_s

    def see(self, time_s: float, view: MarkerView | None) -> None:
        """Take in what a picture shows of the marker."""
        if math.isfinite(self._began_s[_LOST_AT]):
            return
        if readable_probability(view) >= READABLE:
            self._last_readable_s = time_s
            self._began_s[_READABLE_AT] = min(self._began_s[_READABLE_AT], time_s)
        elif time_s - self._last_readable_s >= LOST_AFTER_S:
            self._began_s[_LOST_AT] = time_s

    @property
    def record(self) -> tuple[tuple[str, float], ...]:
        """The moments that came, for the record of the flight."""
        pairs = zip(MOMENTS, self._began_s, strict=True)
        came = tuple((name, time_s) for name, time_s in pairs if math.isfinite(time_s))
        struck = ((moment_of(DECIDED, name), time_s) for name, time_s in self._struck_s.items())
        return (*came, *struck)


class RecordedMoments:
    """The moments of a recorded flight."""

    def __init__(self, flight: Flight) -> None:
        self._came = came = dict(flight.moments or _of_track(flight).record)
        self.began_s = tuple(came.get(name, math.inf) for name in MOMENTS)

    def of_npc(self, name: str) -> tuple[float, ...]:
        """Return when each moment came for which the story of an NPC may wait."""
        own = (self._came.get(moment_of(each, name), math.inf) for each in (MET, DECIDED))
        return (*self.began_s, *own)

    def of_event(self, name: str) -> tuple[float, ...]:
        """Return when each moment came for which an event may wait."""
        return (*self.began_s, self._came.get(moment_of(DECIDED, name), math.inf))

    def known_at(self, time_s: float) -> tuple[float, ...]:
        """Return when each moment came that was known at a decision; infinite for the others.

        A decision falls before the pictures of its time.
        """
        return tuple(
            came_s
            if came_s < time_s or (came_s == time_s and name not in OF_PICTURES)
            else math.inf
            for name, came_s in zip(MOMENTS, self.began_s, strict=True)
        )


def moment_of(moment: str, name: str) -> str:
    """Return the name in a record of a moment that only one NPC or event has."""
    return f"{moment} {name}"


def decided_genes(
    scenario: Scenario, flight: Flight, npcs: PolicySpec
) -> tuple[tuple[str, float], ...]:
    """Return the genes with which a flight repeats if nobody decides: what was decided in it.

    ``npcs`` is the policy that moved the NPCs, which may decide no begin.  An NPC that was let go
    begins after the last moment of the landing before that, by whole milliseconds, rounded down, so
    that it begins with the same decision; one that was not comes too late for the flight.  An event
    strikes at the time after the last moment that was noted in flight.
    """
    moments, genes = RecordedMoments(flight), []
    for event in scenario.decided_events:
        struck_s = moments.of_event(event)[-1]
        number, delay_s = 0, QUANTITIES[f"{event}.from_s"].high
        if math.isfinite(struck_s):
            decision_s = DECISION_STEP_S * math.floor(struck_s / DECISION_STEP_S + 1e-6)
            number, delay_s = _after_latest(moments.known_at(decision_s), decision_s)
        genes += [(f"{event}.after", float(number)), (f"{event}.from_s", delay_s)]
    for key, value in scenario.genes:
        name, _, value_name = key.partition(".")
        if value_name != "phase" or STORY_MOMENTS[int(STORY[value_name].flown(value))] != DECIDED:
            continue
        story, went_s = story_of(scenario, name), moments.of_npc(name)[-1]
        if not npcs.decides_begin or story is None or not waits_for_decision(story):
            number, delay_s = STORY_MOMENTS.index(MET), 0.0
        elif math.isinf(went_s):
            number, delay_s = 0, STORY["delay_s"].quantity.high
        else:
            came = [each if each <= went_s else -math.inf for each in moments.began_s]
            number = came.index(max(came))
            delay_s = math.floor((went_s - came[number]) * 1000) / 1000
        genes += [(key, float(number)), (f"{name}.delay_s", delay_s)]
    return tuple(genes)


def _after_latest(began_s: Sequence[float], time_s: float) -> tuple[int, float]:
    """Return the number of the latest moment that came, and a time after it, rounded up."""
    came = [each if math.isfinite(each) else -math.inf for each in began_s]
    number = came.index(max(came))
    after_s = time_s - came[number]
    parts = 1000 if after_s < _LONG_S else 100
    return number, math.ceil(after_s * parts - 1e-6) / parts


def _of_track(flight: Flight) -> LandingMoments:
    """Return the moments of a simulator that records none, from the heights of its track."""
    moments = LandingMoments()
    for time_s, height_m in zip(flight.uav.time_s, flight.uav.position_m[:, 2], strict=True):
        moments.update(float(time_s), feet_height_m(float(height_m)))
    return moments
