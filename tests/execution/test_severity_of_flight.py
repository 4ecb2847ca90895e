"""What a violation took is measured from the flight, the scenario and the NPC policy."""

from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.execution.severity_of_flight import severity_of
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, with_all_values
from pytest_garl.simulation.landing_moments import RecordedMoments
from pytest_garl.verdicts.verdict import Verdict
from tests.simulation.test_strikes import TELLS, Told, flown, waiting
from tests.support.collisions import CONTACT_S, TIMES, hits_a_person
from tests.support.flights import EMPTY
from tests.support.results import flight_result

LAWN = load_map("lawn")
GENOME = genome_for(LAWN)
ALL = decode(GENOME.nominal, GENOME, map="lawn", seed=0)
ALONE = ALL.without("person-2", "bird-1", "dog-1")
COLLISION = flight_result("IV:person:descent:seen").verdict


def with_story(scenario: Scenario, **values: float | str) -> Scenario:
    told = {**values, "grade": GRADES.index(str(values.get("grade", "careless")))}
    genes = with_all_values({key: float(each) for key, each in told.items()}, "person-1", "person")
    return dataclasses.replace(scenario, genes=(*scenario.genes, *genes.items()))


def severity(scenario: Scenario, policy: str = "graded", verdict: Verdict = COLLISION) -> Severity:
    found = severity_of(hits_a_person(), verdict, scenario, LAWN, policy_spec(policy))
    assert found is not None
    return found


def test_flight_without_violation_has_none() -> None:
    landed = flight_result().verdict
    assert severity_of(hits_a_person(), landed, ALL, LAWN, policy_spec("graded")) is None


def test_crash_of_the_landing_system_has_an_empty_one() -> None:
    crashed = flight_result("V:raised:E", violation_type="V").verdict
    flight = dataclasses.replace(hits_a_person(), outcome="crashed")
    assert severity_of(flight, crashed, ALL, LAWN, policy_spec("graded")) == NO_SEVERITY


def test_planner_that_ended_has_the_conditions_that_acted() -> None:
    ended = flight_result("V:no-plan:hold", violation_type="V").verdict
    flight = dataclasses.replace(hits_a_person(), outcome="held", contacts=())
    found = severity_of(flight, ended, ALL, LAWN, policy_spec("graded"))
    assert found is not None
    assert found.about == "conditions"
    assert found.conditions


def test_careless_person_alone_interferes_for_no_time() -> None:
    found = severity(with_story(ALONE))
    assert found.text == "a careless person at 1.0 m/s"
    assert (found.objects, found.interference_s, found.window_s) == (1, 0.0, None)


def test_speed_is_the_highest_of_the_last_three_seconds() -> None:
    flown = hits_a_person()
    velocity = flown.objects[0].track.velocity_mps
    velocity[TIMES == 28.0, 0] = 3.0
    velocity[TIMES == 26.0, 0] = 9.0
    found = severity_of(flown, COLLISION, with_story(ALONE), LAWN, policy_spec("graded"))
    assert found is not None
    assert found.speed_mps == 3.0


@pytest.mark.parametrize(
    ("policy", "grade"),
    [
        ("graded", "curious"),
        ("careless", "careless"),
        ("chasing", "chasing"),
        ("hostile", "hostile"),
        ("dqn", "hostile"),
        ("waypoint", "careless"),
        ("greedy", "careless"),
    ],
)
def test_grade_is_that_of_what_moved_the_object(policy: str, grade: str) -> None:
    assert severity(with_story(ALONE, grade="curious", lasts_s=20.0), policy).grade == grade


def test_recorded_object_has_the_grade_of_its_story_or_none() -> None:
    recorded = recorded_spec({"person-1": ()})
    told = with_story(ALONE, grade="chasing", lasts_s=5.0)
    for scenario, grade in ((told, "chasing"), (ALONE, "")):
        found = severity_of(hits_a_person(), COLLISION, scenario, LAWN, recorded)
        assert found is not None
        assert found.grade == grade


def test_interference_begins_when_the_object_can_have_noticed_the_uav() -> None:
    # It sees the UAV within 10 m, and learns of it a second later.
    found = severity(with_story(ALONE, grade="curious", lasts_s=20.0))
    assert 6.0 < found.interference_s < 10.0
    short = severity(with_story(ALONE, grade="curious", lasts_s=2.0))
    assert short.interference_s == 2.0
    late = severity(with_story(ALONE, grade="curious", lasts_s=20.0, delay_s=26.0))
    assert late.interference_s == pytest.approx(3.0)
    phase = severity(with_story(ALONE, grade="curious", lasts_s=20.0, phase=2.0))
    assert 0.0 < phase.interference_s < found.interference_s


def test_hostile_object_interferes_during_the_whole_flight() -> None:
    found = severity(ALL, "dqn")
    assert (found.grade, found.interference_s) == ("hostile", CONTACT_S)
    assert found.text.endswith(" for 30.0 s, 3 others there")


def test_object_that_is_not_recorded_has_its_grade_and_type() -> None:
    flown = dataclasses.replace(hits_a_person(), objects=())
    found = severity_of(flown, COLLISION, ALONE, LAWN, policy_spec("waypoint"))
    assert found is not None
    assert found.text == "a careless person at 0.0 m/s"


COVER = {"cover.from_s": 10.0, "cover.lasts_s": 3.0, "cover.share_percent": 100.0}
"""Something lies over the marker from 10 to 13 s."""


@pytest.mark.parametrize(
    ("comes_s", "cover", "words"),
    [
        (9.9, COVER, ""),
        (10.0, COVER, "while the marker is covered"),
        (12.9, COVER | {"cover.share_percent": 40.0}, "while 40 % of the marker is covered"),
        (12.9, COVER | {"cover.share_percent": 0.0}, ""),
        (13.0, COVER, ""),
        (12.0, COVER | {"cover.after": 2.0}, ""),
        (12.0, {}, ""),
    ],
)
def test_body_that_comes_while_the_marker_is_covered_says_so(
    comes_s: float, cover: dict[str, float], words: str
) -> None:
    told = with_story(ALONE, grade="chasing", lasts_s=5.0, delay_s=comes_s).replace(cover)
    assert severity(told).when == words
    assert severity(told, "chasing").when == words
    assert severity(told, "waypoint").when == "", "it does not follow the story"
    lost = flight_result("II:lost", outcome="gave_up", primary="time", violation_type="II").verdict
    beside = severity(told, verdict=lost)
    assert dict(zip(beside.conditions, beside.values, strict=True))["person-1"] == (
        f"comes {words}" if words else ""
    )


@pytest.mark.parametrize(
    ("begins", "words"),
    [
        ({"from_s": 12.0}, "while the marker is covered, lasts 2 s"),
        ({"from_s": 14.0}, "lasts 2 s"),
        ({"from_s": 29.9}, "lasts 2 s"),
        ({"from_s": 60.0}, "did not strike, lasts 2 s"),
        ({"after": 5.0}, "did not strike, lasts 2 s"),
        ({"after": 0.0, "from_s": 12.9}, "while the marker is covered, lasts 2 s"),
    ],
)
def test_event_that_strikes_while_the_marker_is_covered_says_so(
    begins: dict[str, float], words: str
) -> None:
    lost = flight_result("II:lost", outcome="gave_up", primary="time", violation_type="II").verdict
    values = {"outage.lasts_s": 2.0} | {f"outage.{key}": each for key, each in begins.items()}
    found = severity(ALONE.without("person-1").replace(COVER | values), verdict=lost)
    named = dict(zip(found.conditions, found.values, strict=True))
    assert named == {"outage": words, "cover": "lasts 3 s, share 100 %"}
    # What did not strike cannot have acted, and no text names it.
    assert found.idle == (("outage",) if "did not strike" in words else ())
    assert ("outage" in found.unusual) == ("did not strike" not in words)


def test_other_violation_says_its_conditions_and_its_objects() -> None:
    lost = flight_result("II:lost", outcome="gave_up", primary="time", violation_type="II").verdict
    foggy = ALONE.replace({"environment.fog": 0.5})
    assert severity(foggy, verdict=lost).text == "2 conditions: fog (visibility 20 m), person-1"
    alone = severity(foggy.without("person-1"), verdict=lost)
    assert (alone.text, alone.largest_share) == ("fog alone, visibility 20 m", 0.5)


@pytest.mark.parametrize(
    ("delay_s", "unusual"), [(60.0, "person-1 (had not begun)"), (0.0, "person-1")]
)
def test_an_npc_whose_story_begins_after_the_end_had_not_begun(
    delay_s: float, unusual: str
) -> None:
    lost = flight_result("II:lost", outcome="gave_up", primary="time", violation_type="II").verdict
    later = with_story(ALONE, phase=0.0, delay_s=delay_s)
    assert severity(later, verdict=lost).unusual == unusual


@pytest.mark.sim
def test_marker_is_covered_in_the_pictures_of_a_flight_that_says_so() -> None:
    Told.at_s = 13.5
    covered = {"cover.from_s": 12.0, "cover.lasts_s": 3.0, "cover.share_percent": 100.0}
    scenario = waiting("burst").replace(covered)
    flight = flown(scenario, TELLS)
    lost = flight_result("II:lost", outcome="gave_up", primary="time", violation_type="II").verdict
    found = severity_of(flight, lost, scenario, EMPTY, TELLS)
    assert found is not None
    (burst,) = (value for value in found.values if "latency" in value)
    assert "while the marker is covered" in burst
    struck_s = RecordedMoments(flight).of_event("burst")[-1]
    hidden = {each.time_s: each.marker.bits_hidden for each in flight.steps if each.marker}
    assert min(hidden[t] for t in hidden if 12.2 < t <= struck_s) > 0.4
    assert max(hidden[t] for t in hidden if t < 12.0) < 0.1
