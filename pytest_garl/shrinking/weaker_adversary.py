"""Try weaker adversaries first: a straight careless crossing, then lower grades of the object."""

from __future__ import annotations

import dataclasses

from pytest_garl.cases.case import RecordedBehaviour
from pytest_garl.flight.flight_file import load
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, Story, story_of
from pytest_garl.shrinking.case_flights import (
    CaseFlights,
    find_colliding_object,
    recorded_behaviour,
)
from pytest_garl.shrinking.case_request import FailingScenario
from pytest_garl.shrinking.move_reduction import rounded, shortened
from pytest_garl.shrinking.plan import (
    CROSSING,
    CROSSING_AGAIN,
    CROSSING_AGAIN_BEFORE_LOWER_GRADE,
    LOWER_GRADE,
    Step,
)
from pytest_garl.shrinking.simplification import (
    bare_scenario_around_marker,
    without_other_objects,
)
from pytest_garl.shrinking.straight_crossing import (
    SHIFTS_S,
    encounter_of,
    retimed_encounter,
    shifted,
    straight_crossing,
)

CARELESS = "careless"


def confirm_crossing(flights: CaseFlights, first: Scenario) -> FailingScenario | None:
    """Return the straight careless crossing of the place of a collision, if the UAV hits it too.

    First in clear weather, there once more if the UAV came to the place at another time, then in
    the conditions that were found.  The window of its entry is measured in place of neighbours.
    """
    completed = flights.live_flight(first)
    if not flights.request.asks_prevention or not completed.record.exists():
        return None
    encounter = encounter_of(load(completed.record), flights.map)
    if encounter is None:
        return None
    name, map = encounter.name, flights.map
    clear = bare_scenario_around_marker(first, map, name)
    tried: list[Scenario] = []
    left = [(clear, encounter), (without_other_objects(first, map, name), encounter)]
    while left:
        bare, met = left.pop(0)
        scenario = straight_crossing(bare, met, map)
        if scenario is None or scenario in tried or not flights.suffice_for(CROSSING):
            continue
        tried.append(scenario)
        flight = flights.fly_moved_by(scenario, policy_spec(CARELESS))
        if flights.request.fails(scenario, flight):
            behaviour = shortened(recorded_behaviour(flight, scenario, map))
            found = FailingScenario(
                origin=first, scenario=scenario, behaviour=behaviour, flight=flight
            )
            return _with_window(flights, found, name)
        if bare is clear and met is encounter and flight.record.exists():
            again = retimed_encounter(encounter, load(flight.record))
            if again is not None and flights.suffice_for(_crossing_again(flights, first)):
                left.insert(0, (clear, again))
    return None


def _with_window(flights: CaseFlights, found: FailingScenario, name: str) -> FailingScenario | None:
    """Return a crossing with its record and its window; None if the record does not fail."""
    recorded = _with_record(flights, found)
    if recorded is None:
        return None
    failing = {0.0}
    flown = 0
    for shift in SHIFTS_S:
        inner = shift - shift / abs(shift)
        if inner not in failing or not flights.left:
            # The run of entries that fail has ended.
            continue
        scenario = shifted(found.scenario, name, shift, flights.map)
        if scenario is None:
            continue
        flown += 1
        if flights.request.fails_alike(flights.fly_moved_by(scenario, policy_spec(CARELESS))):
            failing.add(shift)
    return dataclasses.replace(
        recorded,
        neighbours_failed=len(failing) - 1,
        neighbours_flown=flown,
        npcs=policy_spec(CARELESS),
        window_s=max(failing) - min(failing),
    )


def _with_record(flights: CaseFlights, found: FailingScenario) -> FailingScenario | None:
    """Return a failure with its moves in whole hundredths, or as they are, if that fails."""
    for behaviour in dict.fromkeys((rounded(found.behaviour), found.behaviour)):
        if not flights.left:
            break
        flight = flights.fly_recorded(found.scenario, behaviour)
        if flights.request.fails(found.scenario, flight):
            return dataclasses.replace(found, behaviour=behaviour, flight=flight)
    return None


def _crossing_again(flights: CaseFlights, first: Scenario) -> Step:
    """Return what crossings at another time take, and keep for a lower grade of the body."""
    story = _graded_story(flights, first)
    has_lower_grade = story is not None and story.grade != CARELESS
    return CROSSING_AGAIN_BEFORE_LOWER_GRADE if has_lower_grade else CROSSING_AGAIN


def _graded_story(flights: CaseFlights, first: Scenario) -> Story | None:
    """Return the story of the object that was hit, None if it does not move by its own grade."""
    name = find_colliding_object(flights.live_flight(first))
    story = story_of(first, name) if name else None
    return None if flights.request.job.npcs.grade else story


def confirm_lower_grade(flights: CaseFlights, first: Scenario) -> FailingScenario | None:
    """Return the object that was hit, alone, in the lowest grade in which it is still hit.

    Grades are tried one by one, downwards.  Asked only where each object moves by its own story.
    """
    name = find_colliding_object(flights.live_flight(first))
    story = _graded_story(flights, first)
    if story is None:
        return None
    alone = bare_scenario_around_marker(first, flights.map, name)
    lowest: Scenario | None = None
    for grade in reversed(range(GRADES.index(story.grade))):
        if not flights.suffice_for(LOWER_GRADE):
            break
        scenario = alone.replace({f"{name}.grade": float(grade)})
        if not flights.fails_live(scenario):
            break
        lowest = scenario
    if lowest is None:
        return None
    behaviour: RecordedBehaviour = flights.live_behaviour(lowest)
    return flights.confirm(first, lowest, behaviour)
