"""Stories of NPCs in scenarios and in their files."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dumps, loads
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, LIMITS_S, STORY, story_of
from pytest_garl.scenarios.validity import repair
from tests.support.stories import scenario_with

LAWN = load_map("lawn")
FIELD = domain_named("field")
GENOME = genome_of(FIELD, LAWN, is_dense=True)


def drawn(count: int) -> list[Scenario]:
    rng = np.random.default_rng(3)
    rows = (GENOME.random(rng) for _ in range(count))
    return [repair(decode(row, GENOME, map="lawn", seed=1), LAWN) for row in rows]


def test_field_draws_all_grades_up_to_chasing_and_calm_careless_only() -> None:
    grades = {story.grade for each in drawn(40) if (story := story_of(each, "person-1"))}
    assert grades == {"careless", "curious", "chasing"}
    calm = genome_of(domain_named("calm"), LAWN, is_dense=True)
    rng = np.random.default_rng(3)
    for _ in range(20):
        scenario = decode(calm.random(rng), calm, map="lawn", seed=1)
        story = story_of(scenario, "person-1")
        assert story is not None
        assert story.grade == "careless"


def test_no_drawn_story_interferes_for_longer_than_its_grade_may() -> None:
    for scenario in drawn(40):
        for name, _ in LAWN.all_objects:
            story = story_of(scenario, name)
            assert story is not None
            assert story.lasts_s <= LIMITS_S[story.grade]


def test_half_of_the_careless_persons_pause() -> None:
    stories = [story_of(each, "person-1") for each in drawn(100)]
    pauses = [each.pause_s > 0 for each in stories if each and each.grade == "careless"]
    assert 0.3 < sum(pauses) / len(pauses) < 0.7


def test_the_paper_has_no_stories() -> None:
    genome = genome_of(domain_named("paper"), LAWN)
    assert not [key for key in genome.keys if key.partition(".")[2] in STORY]


def test_a_file_states_what_counts_for_the_grade() -> None:
    values = {"grade": 2.0, "lasts_s": 3.0, "pause_s": 40.0, "crosses_x_m": 1.0, "phase": 1.0}
    text = dumps(repair(scenario_with("dog-1", (5.0, 5.0), 4.0, values), LAWN), LAWN)
    section = text[text.index("[scenario.dog-1]") :]
    assert 'grade = "chasing"' in section
    assert 'phase = "8 m"' in section
    assert "lasts_s = 3.0" in section
    assert "pause_s" not in section
    assert "crosses" not in section


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('grade = "angry"', "grade': found 'angry', expected one of careless, curious, chasing"),
        ("pause_s = 90.0", "pause_s': found 90.0, expected"),
        ("wings = 2", "unknown"),
    ],
)
def test_a_wrong_value_of_a_story_is_named(line: str, words: str) -> None:
    text = dumps(repair(scenario_with("dog-1", (5.0, 5.0), 4.0, {}), LAWN), LAWN)
    text = text.replace(
        'grade = "careless"', line if "grade" in line else f'grade = "careless"\n{line}'
    )
    with pytest.raises(ScenarioError, match=r"scenario\.dog-1") as error:
        loads(text, LAWN)
    assert words in str(error.value)


def test_a_story_without_a_grade_is_refused() -> None:
    text = dumps(repair(scenario_with("dog-1", (5.0, 5.0), 4.0, {}), LAWN), LAWN)
    with pytest.raises(ScenarioError, match=r"scenario\.dog-1\.grade': missing"):
        loads(text.replace('grade = "careless"', "delay_s = 1.0"), LAWN)


def test_a_child_is_smaller_and_hit_as_a_child() -> None:
    child = scenario_with("person-2", (5.0, 5.0), 2.0, {"body": 1.0})
    adult = scenario_with("person-2", (5.0, 5.0), 2.0, {})
    assert Placed(child, LAWN).npc("person-2").type.height_m < 1.2
    assert Placed(adult, LAWN).npc("person-2").type.height_m > 1.7
    assert dict(Placed(child, LAWN).map.present_objects) == {"person-2": "child"}
    again = loads(dumps(repair(child, LAWN), LAWN), LAWN)
    assert story_of(again, "person-2") == story_of(repair(child, LAWN), "person-2")


def test_a_grade_beyond_the_domain_is_named() -> None:
    hostile = scenario_with("dog-1", (5.0, 5.0), 4.0, {"grade": float(GRADES.index("hostile"))})
    assert "dog-1 is hostile, the domain ends at chasing" in FIELD.outside(hostile, LAWN)
    calm = dataclasses.replace(FIELD, npc_behaviour="careless")
    assert not [
        each for each in calm.outside(drawn(1)[0].without("bird-1"), LAWN) if "hostile" in each
    ]


def test_a_file_states_the_moment_of_an_event() -> None:
    tied = {"outage.after": 4.0, "outage.from_s": 1.5, "outage.lasts_s": 2.0}
    scenario = repair(scenario_with("dog-1", (5.0, 5.0), 4.0, {}).replace(tied), LAWN)
    text = dumps(scenario, LAWN)
    assert 'after = "readable"' in text
    assert loads(text, LAWN) == scenario
    assert "after" not in dumps(repair(scenario.replace({"outage.after": 0.0}), LAWN), LAWN)
    decided = repair(scenario.replace({"outage.after": 6.0}), LAWN)
    text = dumps(decided, LAWN)
    assert 'after = "decided"' in text
    assert "from_s" not in text, "the director decides"
    assert loads(text, LAWN) == decided
    with pytest.raises(ScenarioError, match="expected one of start, 8 m, 3 m, touchdown"):
        loads(text.replace('"decided"', '"seen"'), LAWN)
