"""Describe a violation and a scenario in words, for a reader who has not seen the flight."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from pytest_garl.cases.case import Violation
from pytest_garl.cases.story_text import story_in_words
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.flight.flight import Flight, ObjectRecord
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed, PlacedNpc
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import conditions_in_words
from pytest_garl.verdicts.verdict import Verdict
from pytest_garl.verdicts.wording import compass_point

NEAR_M = 3.0
"""Horizontal distance at which an object enters the scene: twice the UAV's length and the object's
own stride."""


def describe(
    flight: Flight,
    verdict: Verdict,
    severity: Severity = NO_SEVERITY,
    *,
    is_shrunk: bool = False,
) -> str:
    """Return the verdict's sentence behind what it took, or what was unusual if it is not shrunk.

    After a collision that is how the moving object came near, else the conditions.
    """
    if severity.about == "conditions":
        if is_shrunk:
            return f"{_sentence(severity.text)}: {verdict.story}"
        return f"{unusual_in_flight(severity)} {verdict.story}"
    contact = flight.contacts[-1] if flight.contacts else None
    if verdict.violation_type != "IV" or contact is None:
        return verdict.story
    hit = next((item for item in flight.objects if item.name == contact.body), None)
    return f"{_approach(flight, hit, severity)} {verdict.story}" if hit else verdict.story


def unusual_in_flight(severity: Severity) -> str:
    """Return a sentence about a flight of which nobody knows what it took; it may be empty."""
    if not severity.about:
        return ""
    if not severity.unusual:
        return "Nothing was unusual in this flight, unless it is where the marker lies."
    return f"Unusual in this flight: {severity.unusual}."


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _approach(flight: Flight, hit: ObjectRecord, severity: Severity) -> str:
    """Return how the object came near: ``A careless dog at 2.1 m/s enters from the south ...``."""
    uav, own = flight.uav.position_m, hit.track.position_m
    distance = np.hypot(own[:, 0] - uav[:, 0], own[:, 1] - uav[:, 1])
    outside = np.flatnonzero(distance > NEAR_M)
    entered = int(outside[-1]) + 1 if len(outside) else 0
    entered = min(entered, len(distance) - 1)
    up = feet_height_m(float(uav[entered, 2]))
    speeds = np.hypot(hit.track.velocity_mps[:, 0], hit.track.velocity_mps[:, 1])
    speed = float(speeds[entered:].max())
    kind = " ".join(word for word in (severity.grade, hit.type) if word)
    kind = f"{_article(kind)} {kind}"
    if speed < 0.1:
        return f"{kind} stands still in the UAV's way, {up:.1f} m below it."
    side = own[entered] - uav[entered]
    point = compass_point(float(side[0]), float(side[1]))
    told = f"{kind} at {speed:.1f} m/s"
    if severity.about == "body":
        told = _sentence(severity.unusual)
        told += "," if severity.objects > 1 or severity.when else ""
    return (
        f"{told} enters from the {point} while the UAV is {up:.1f} m above "
        f"{_ground_below(flight, uav[entered])}."
    )


def _ground_below(flight: Flight, position: np.ndarray) -> str:
    mx, my = flight.marker_position_m
    distance = math.hypot(float(position[0]) - mx, float(position[1]) - my)
    return "the marker" if distance < 1.0 else f"the ground, {distance:.1f} m from the marker"


def _article(word: str) -> str:
    return "An" if word[0] in "aeiou" else "A"


def describe_scenario(
    scenario: Scenario, map_folders: tuple[Path, ...], policy: str = "graded"
) -> list[tuple[str, str]]:
    """Return what is off nominal as (subject, words), in physical units.

    ``policy`` names the NPC policy: one without grades does not follow the stories.
    """
    return describe_scenario_on(scenario, load_map(scenario.map, map_folders), policy)


def describe_scenario_on(
    scenario: Scenario, map: Map, policy: str = "graded"
) -> list[tuple[str, str]]:
    """Return what :func:`describe_scenario` does, for a map that is read already."""
    rows = conditions_in_words(scenario, map)
    placed = Placed(scenario, map)
    x, y = placed.marker_m
    rows.append(("marker", f"at ({x:.1f}, {y:.1f}) m, east and north"))
    for name, _ in placed.map.present_objects:
        story = story_in_words(placed, name, policy)
        rows.append((name, story or _npc_in_words(placed.npc(name))))
    return rows


def _npc_in_words(npc: PlacedNpc) -> str:
    (x, y), goal = npc.start_m, npc.destination_m
    way = f"from ({x:.1f}, {y:.1f}) m"
    way += f" to ({goal[0]:.1f}, {goal[1]:.1f}) m and back" if goal else ""
    return f"a {npc.type.name} of up to {npc.speed_mps:.2f} m/s, {way}"


def scenario_in_words(
    scenario: Scenario, map_folders: tuple[Path, ...], policy: str = "graded"
) -> str:
    """Return what is off nominal in one line; words of weather and light name their subject."""
    return "; ".join(
        f"{subject} {words}" if "." in subject or words.startswith(("at ", "a ")) else words
        for subject, words in describe_scenario(scenario, map_folders, policy)
    )


def violation_in(
    verdict: Verdict, flight: Flight | None, severity: Severity, *, is_shrunk: bool
) -> Violation:
    """Return the violation that a verdict found."""
    assert verdict.primary is not None
    assert verdict.violation_type is not None
    margin = next((each for each in verdict.margins if each.property == verdict.primary), None)
    return Violation(
        signature=verdict.signature,
        type=verdict.violation_type,
        property=verdict.primary,
        margin=margin.value if margin else 0.0,
        unit=margin.unit if margin else "1",
        description=describe(flight, verdict, severity, is_shrunk=is_shrunk)
        if flight
        else verdict.story,
    )
