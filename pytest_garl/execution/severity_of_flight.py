"""Measure how severe the violation of one flight is."""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.flight.flight import Contact, Flight, ObjectRecord
from pytest_garl.npcs.domain_policy import READ_STORIES
from pytest_garl.npcs.grades import GRADE_LIMITS
from pytest_garl.scenarios.conditions import ActiveCondition, active_conditions, unread_groups
from pytest_garl.scenarios.groups import COVER, EVENTS
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.quantities import significant
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import LIMITS_S, Story, story_of
from pytest_garl.simulation.events import Beginning, Event
from pytest_garl.simulation.landing_moments import RecordedMoments
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import Verdict

RECENT_S = 3.0
"""The speed of a body is its highest within this time before the contact."""
DID_NOT_STRIKE = "did not strike"
"""Said of an event for whose moment the flight was too short."""
DID_NOT_BEGIN = "had not begun"
"""Said of an NPC whose story begins after the flight's end."""
CENTIMETRES = 2
"""Digits of lengths of time and of speeds."""


def severity_of(
    flight: Flight, verdict: Verdict, scenario: Scenario, map: Map, npcs: PolicySpec
) -> Severity | None:
    """Return what the violation of a flight took; None if it violates nothing.

    ``npcs`` is the policy that moved the objects; a policy without a grade of its own moves each
    object by the grade of its story.
    """
    if not verdict.violation:
        return None
    if flight.outcome == "crashed":
        return NO_SEVERITY
    present = tuple(name for name, _ in map.without(scenario.removed_objects).present_objects)
    if verdict.violation_type == "IV" and flight.contacts:
        return _of_body(flight, flight.contacts[-1], scenario, len(present), npcs)
    conditions = [_at_its_moment(each, flight, scenario) for each in active_conditions(scenario)]
    idle = idle_groups(scenario, flight)
    acting = [each for each in conditions if each.cause not in idle]
    strongest = max(acting, key=lambda each: each.share, default=None)
    return Severity(
        about="conditions",
        conditions=(*(each.cause for each in conditions), *present),
        values=(
            *(each.named for each in conditions),
            *(_comes(flight, scenario, name, npcs) for name in present),
        ),
        largest=strongest.words if strongest else "",
        # Of all conditions, so that what a system reads does not change which scenarios are bred.
        largest_share=max((each.share for each in conditions), default=0.0),
        idle=idle,
        placed=scenario.has_moved_marker,
    )


def idle_groups(scenario: Scenario, flight: Flight) -> tuple[str, ...]:
    """Return the groups that cannot have acted in the flight of a scenario.

    They change only data that was never read, or are events that did not strike.
    """
    moments = RecordedMoments(flight)
    active = {each.cause for each in active_conditions(scenario)}
    late = (
        name
        for name in EVENTS
        if name in active and Beginning(scenario, name, moments).time_s >= flight.elapsed_s
    )
    return tuple(dict.fromkeys((*unread_groups(scenario, flight.data_read), *late)))


def _of_body(
    flight: Flight, contact: Contact, scenario: Scenario, objects: int, npcs: PolicySpec
) -> Severity:
    # A user's own simulator may not record its objects.
    hit = next((item for item in flight.objects if item.name == contact.body), None)
    story = story_of(scenario, contact.body)
    grade = npcs.grade or (story.grade if story else "")
    return Severity(
        about="body",
        grade=grade,
        type=hit.type if hit else contact.kind,
        objects=objects,
        interference_s=_interference_s(flight, contact, hit, grade, story),
        speed_mps=_speed_mps(hit, contact.time_s) if hit else 0.0,
        when=_when_it_comes(flight, scenario, contact.body, npcs),
    )


def _at_its_moment(
    condition: ActiveCondition, flight: Flight, scenario: Scenario
) -> ActiveCondition:
    """Return a condition that says of an event when it struck, and what covered the marker then."""
    name = condition.cause
    if name not in EVENTS:
        return condition
    begins_s = Beginning(scenario, name, RecordedMoments(flight)).time_s
    if begins_s >= flight.elapsed_s:
        return dataclasses.replace(condition, when=DID_NOT_STRIKE)
    covered = _while_covered(flight, scenario, begins_s) if name != COVER.name else ""
    return dataclasses.replace(condition, when=", ".join(filter(None, (condition.when, covered))))


def _while_covered(flight: Flight, scenario: Scenario, time_s: float) -> str:
    """Return ``while the marker is covered`` if something covers it at a time of the flight."""
    share = scenario["cover.share_percent"]
    cover = Event(scenario, COVER.name, RecordedMoments(flight))
    if not share or time_s >= flight.elapsed_s or not cover.happens(time_s):
        return ""
    part = "" if share == 100 else f"{significant(share, 2):g} % of "
    return f"while {part}the marker is covered"


def _comes(flight: Flight, scenario: Scenario, name: str, npcs: PolicySpec) -> str:
    begins_s = _begins_s(flight, scenario, name, npcs)
    if begins_s is not None and begins_s >= flight.elapsed_s:
        return DID_NOT_BEGIN
    when = _when_it_comes(flight, scenario, name, npcs)
    return f"comes {when}" if when else ""


def _begins_s(flight: Flight, scenario: Scenario, name: str, npcs: PolicySpec) -> float | None:
    """Return when the story of a body begins; None for one without, and if nobody follows it."""
    story = story_of(scenario, name)
    if story is None or npcs.name not in READ_STORIES or story.grade == "hostile":
        return None
    return story.begins_s(RecordedMoments(flight).of_npc(name))


def _when_it_comes(flight: Flight, scenario: Scenario, name: str, npcs: PolicySpec) -> str:
    """Return ``while the marker is covered`` if a body comes then."""
    begins_s = _begins_s(flight, scenario, name, npcs)
    return "" if begins_s is None else _while_covered(flight, scenario, begins_s)


def _speed_mps(hit: ObjectRecord, until_s: float) -> float:
    """Return the highest horizontal speed of a body shortly before the contact."""
    track = hit.track
    recent = (track.time_s >= until_s - RECENT_S) & (track.time_s <= until_s)
    speeds = np.hypot(track.velocity_mps[recent, 0], track.velocity_mps[recent, 1])
    return round(float(speeds.max()), CENTIMETRES) if len(speeds) else 0.0


def _interference_s(
    flight: Flight, contact: Contact, hit: ObjectRecord | None, grade: str, story: Story | None
) -> float:
    """Return how long a body interfered until the contact, as far as its track shows it.

    A hostile one attacks during the whole flight.  One that sees the UAV in part interferes from
    when it is near enough to see it, and has had the time to notice it; solids between them do not
    count.
    """
    if grade == "hostile":
        return round(contact.time_s, CENTIMETRES)
    limits = GRADE_LIMITS.get(grade)
    if limits is None or hit is None:
        return 0.0
    moments_s = RecordedMoments(flight).of_npc(hit.name)
    begins_s = story.begins_s(moments_s) if story else 0.0
    lasts_s = min(story.lasts_s, LIMITS_S[grade]) if story else LIMITS_S[grade]
    time_s, apart_m = hit.track.time_s, hit.track.position_m - flight.uav.position_m
    near = (time_s >= begins_s) & (np.linalg.norm(apart_m, axis=1) <= limits.sees_within_m)
    if not near.any():
        return 0.0
    noticed_s = float(time_s[int(near.argmax())]) + limits.delay_s
    return round(min(lasts_s, max(0.0, contact.time_s - noticed_s)), CENTIMETRES)
