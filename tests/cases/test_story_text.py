from __future__ import annotations

import pytest

from pytest_garl.cases.story_text import grade_in_words, story_in_words
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.story import GRADES, STORY_MOMENTS
from tests.cases.samples import case
from tests.support.stories import EMPTY, scenario_with

PERSON = {"grade": 0.0, "phase": 1.0, "delay_s": 2.1, "crosses_x_m": 0.4, "pause_s": 12.0}
DOG = {"phase": 3.0, "lasts_s": 20.0}


def test_careless_walker_is_told_by_its_way_its_crossing_and_its_pause() -> None:
    scenario = scenario_with("person-1", (-5.2, -0.3), 1.4, PERSON)
    assert story_in_words(Placed(scenario, EMPTY), "person-1") == (
        "a careless person: sets off from (-5.2, -0.3) m 2.1 s after the UAV passes 8 m, "
        "crosses 0.4 m east of the marker at 1.4 m/s, stands there for 12.0 s"
    )


def test_story_without_delay_and_offset_needs_no_numbers_for_them() -> None:
    scenario = scenario_with("dog-1", (-5.0, 0.0), 4.0, {"grade": 0.0})
    assert story_in_words(Placed(scenario, EMPTY), "dog-1") == (
        "a careless dog: sets off from (-5.0, 0.0) m when the flight begins, "
        "crosses the middle of the marker at 4.0 m/s"
    )


@pytest.mark.parametrize(
    ("grade", "words"),
    [
        ("curious", "interferes for at most 20.0 s"),
        ("chasing", "pursues the UAV for at most 5.0 s"),
    ],
)
def test_interfering_animal_is_told_by_when_it_comes_and_how_long_it_stays(
    grade: str, words: str
) -> None:
    scenario = scenario_with("dog-1", (3.0, 4.0), 6.0, {**DOG, "grade": GRADES.index(grade)})
    assert story_in_words(Placed(scenario, EMPTY), "dog-1") == (
        f"a {grade} dog: sets off from (3.0, 4.0) m when the UAV touches down, "
        f"moves at up to 6.0 m/s, {words}"
    )


def test_hostile_animal_is_there_from_the_start() -> None:
    scenario = scenario_with("dog-1", (3.0, 4.0), 6.0, {"grade": 3.0})
    assert story_in_words(Placed(scenario, EMPTY), "dog-1") == (
        "a hostile dog: is there from the start, at (3.0, 4.0) m, moves at up to 6.0 m/s, "
        "attacks during the whole flight"
    )


def test_bird_is_told_by_its_side_its_height_and_its_stoop() -> None:
    told = {"grade": 0.0, "delay_s": 1.5, "stoop_m": 4.0, "crosses_y_m": -1.0}
    scenario = scenario_with("bird-1", (-9.0, -1.0), 9.0, told, height_m=3.0)
    assert story_in_words(Placed(scenario, EMPTY), "bird-1") == (
        "a careless bird: comes from the west 1.5 s after the flight begins, "
        "crosses 1.0 m south of the marker at 9.0 m/s, 3.0 m up and down to 1.0 m"
    )


def test_story_is_told_only_if_the_policy_follows_it() -> None:
    scenario = scenario_with("dog-1", (3.0, 4.0), 6.0, {**DOG, "grade": 2.0})
    assert story_in_words(Placed(scenario, EMPTY), "dog-1", "dqn") == ""
    assert "a curious dog" in story_in_words(Placed(scenario, EMPTY), "dog-1", "curious")
    assert story_in_words(Placed(case().scenario, EMPTY), "dog-1") == ""


def test_every_grade_and_every_phase_has_words() -> None:
    assert all(grade_in_words(grade).startswith("it ") for grade in GRADES)
    assert grade_in_words("") == ""
    for phase in range(len(STORY_MOMENTS)):
        told = {"grade": 0.0, "phase": float(phase)}
        scenario = scenario_with("dog-1", (3.0, 4.0), 6.0, told)
        assert " when " in story_in_words(Placed(scenario, EMPTY), "dog-1")
