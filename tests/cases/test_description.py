from __future__ import annotations

from pytest_garl.cases.description import describe, describe_scenario, scenario_in_words
from pytest_garl.execution.severity import Severity
from tests.cases.samples import case
from tests.support.collisions import hits_a_person
from tests.support.results import flight_result


def test_scenario_is_described_in_physical_units() -> None:
    scenario = case().scenario.replace({"environment.fog": 0.1})
    rows = dict(describe_scenario(scenario, ()))
    assert rows["fog_visibility_m"] == "fog, visibility 100 m"
    assert rows["marker"].endswith("m, east and north")
    (dog,) = (meaning for what, meaning in rows.items() if what.startswith("dog"))
    assert dog.startswith("a dog of up to ")


def test_one_line_names_each_condition_and_the_kind_of_a_decoy() -> None:
    changes = {"environment.fog": 0.1, "decoy-1.kind": 7.0, "wind.mean_mps": 3.0}
    line = scenario_in_words(case().scenario.replace(changes), ())
    assert "; wind.mean_mps 3 m/s: mean speed at a height of 6 m; decoy-1.kind qr-code; " in line
    assert "fog, visibility 100 m; " in line
    assert "fog_visibility_m" not in line


PERSON = Severity(about="body", grade="careless", type="person", objects=2, speed_mps=1.4)


def test_description_of_a_collision_begins_with_the_adversary() -> None:
    verdict = flight_result("IV:person:descent:seen", story="Collided.").verdict
    told = describe(hits_a_person(), verdict, PERSON)
    start = "A careless person at 1.4 m/s, 1 other there, enters from the west while the UAV is "
    assert told.startswith(start)
    assert told.endswith(" Collided.")
    assert describe(hits_a_person(), verdict).startswith("A person at 1.0 m/s enters from ")
    stands = describe(hits_a_person(0.0), verdict, PERSON)
    assert stands.startswith("A careless person stands still in the UAV's way")


def test_description_of_a_collision_says_that_the_marker_was_covered() -> None:
    verdict = flight_result("IV:person:descent:seen", story="Collided.").verdict
    alone = Severity(
        about="body",
        grade="careless",
        type="person",
        objects=1,
        speed_mps=1.4,
        when="while the marker is covered",
    )
    told = describe(hits_a_person(), verdict, alone)
    assert told.startswith(
        "A careless person at 1.4 m/s, which comes while the marker is covered, enters from the "
        "west while the UAV is "
    )


def test_description_of_another_violation_begins_with_its_conditions() -> None:
    verdict = flight_result("II:lost", violation_type="II", story="Gave up.").verdict
    fog = Severity(about="conditions", conditions=("fog",), values=("visibility 11 m",))
    told = describe(hits_a_person(), verdict, fog, is_shrunk=True)
    assert told == "Fog alone, visibility 11 m: Gave up."


def test_description_of_a_violation_without_conditions_says_that_nothing_was_unusual() -> None:
    verdict = flight_result("II:lost", violation_type="II", story="Gave up.").verdict
    nothing = Severity(about="conditions")
    told = describe(hits_a_person(), verdict, nothing, is_shrunk=True)
    assert told == "Nothing unusual: Gave up."
    told = describe(hits_a_person(), verdict, nothing)
    assert told == (
        "Nothing was unusual in this flight, unless it is where the marker lies. Gave up."
    )
