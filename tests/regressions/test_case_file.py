from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.errors import ScenarioError
from pytest_garl.messages import printable
from pytest_garl.regressions.case_file import dump_case, load_case, parse_case
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for, with_destinations
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.validity import repair
from tests.regressions.samples import LAWN, NAMES, case, case_with_changes

ROOT = Path(__file__).parents[2]


def test_a_case_survives_its_file_and_has_the_same_bytes_again() -> None:
    text = dump_case(case())
    assert parse_case(text, load_map) == case()
    assert dump_case(parse_case(text, load_map)) == text


COMMITTED = [
    path
    for folder in ("scenarios/regressions", "docs/tutorial/scenarios/regressions")
    for path in sorted((ROOT / folder).glob("*/*.toml"))
]


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: path.stem)
def test_a_committed_case_keeps_its_bytes_and_its_name(path: Path) -> None:
    committed = load_case(path)
    assert dump_case(committed) == path.read_text(encoding="utf-8")
    assert committed.id == path.stem


def test_the_id_of_a_case_stays() -> None:
    assert case().id == "lawn-IV-dog-33ab15"
    assert case_with_changes().id == "lawn-IV-dog-96cf0c"


@settings(deadline=None)
@given(st.text())
def test_no_description_breaks_the_file(description: str) -> None:
    strange = case(description=description)
    assert parse_case(dump_case(strange), load_map) == case(description=printable(description))


def test_a_case_with_destinations_survives_its_file() -> None:
    genome = with_destinations(genome_for(LAWN))
    row = genome.random(np.random.default_rng(1))
    scenario = repair(decode(row, genome, map="lawn", seed=9), LAWN).without(*NAMES[:-1])
    bound = dataclasses.replace(case(), scenario=scenario, policy="destination")
    assert parse_case(dump_case(bound), load_map) == bound


def test_what_a_policy_changed_of_the_environment_survives_the_file() -> None:
    text = dump_case(case_with_changes())
    assert f'{NAMES[-1]} = [[0, "environment.fog", 0.01], [2, "environment.sun_position"' in text
    assert parse_case(text, load_map) == case_with_changes()
    assert dump_case(parse_case(text, load_map)) == text
    assert case_with_changes().id != case().id
    assert "[changes]" not in dump_case(case())


def test_names_with_quotes_and_backslashes_survive_the_file() -> None:
    strange = dataclasses.replace(case(), system="stack:Länder", test='te"st.py::test\\it')
    odd = dataclasses.replace(LAWN, name='la"wn\\')
    strange = dataclasses.replace(
        strange, scenario=dataclasses.replace(strange.scenario, map=odd.name)
    )
    assert parse_case(dump_case(strange), lambda _: odd) == strange


def test_a_case_keeps_the_test_that_found_it_and_the_hashes_of_the_sources() -> None:
    plain = case()
    evidence = dataclasses.replace(
        plain.evidence, system_sha256="ef" * 32, simulator_sha256="12" * 32
    )
    told = dataclasses.replace(plain, test="tests/test_it.py::TestIt::test_a", evidence=evidence)
    assert parse_case(dump_case(told), load_map) == told
    assert told.id == plain.id
    assert told.own_test == ""


def test_a_case_of_a_tests_own_assertion_belongs_to_that_test_wherever_its_file_is() -> None:
    old = dataclasses.replace(case(), test="test_own", assertion="12345678")
    told = dataclasses.replace(old, test="tests/test_it.py::test_own")
    assert parse_case(dump_case(old), load_map) == old
    assert (told.own_test, told.id) == ("test_own", old.id)
    assert told.id != case().id


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[0, ", "[-1, "),
        ("[0, ", "[0.5, "),
        ('"environment.fog"', '"wind.x"'),
        ("0.01]", "nan]"),
        ("0.01]", '"a little"]'),
        ("0.01]", "0.01, 3]"),
    ],
)
def test_changes_that_make_no_sense_name_source_and_key(old: str, new: str) -> None:
    text = dump_case(case_with_changes())
    start = text.index("[changes]")
    broken = text[:start] + text[start:].replace(old, new, 1)
    words = rf"lawn-x.toml: key 'changes.{NAMES[-1]}': found .* expected a list of \[decision, gene"
    with pytest.raises(ScenarioError, match=words):
        parse_case(broken, load_map, source="lawn-x.toml")


def test_an_unknown_object_changes_nothing() -> None:
    text = dump_case(case_with_changes()).replace(f'{NAMES[-1]} = [[0, "env', 'cat-1 = [[0, "env')
    with pytest.raises(ScenarioError, match=r"'changes.cat-1': unknown key"):
        parse_case(text, load_map)


def test_a_negative_zero_survives_the_file_with_the_name() -> None:
    plain = dataclasses.replace(
        case(), moves=((NAMES[-1], ((0.0, 0.0), (0.0, -0.0), (-0.0, 0.0))),)
    )
    again = parse_case(dump_case(plain), load_map)
    assert repr(again.moves) == repr(plain.moves)
    assert again.id == plain.id


def test_moves_are_written_as_runs() -> None:
    assert f"{NAMES[-1]} = [[2, 0.0, 0.0], [1, 0.6, -0.8]]" in dump_case(case())


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[[2, 0.0, 0.0]", "[[2.5, 0.0, 0.0]", "expected a list of \\[times, x, y\\]"),
        ("[[2, 0.0, 0.0]", "[[0, 0.0, 0.0]", "times of at least 1"),
        ("0.6, -0.8", "0.9, -0.8", "at most 1"),
        ("0.6, -0.8", "nan, -0.8", "at most 1"),
        ('status = "open"', 'status = "known"', "'status': found 'known'"),
        ("[policy]", "[polices]", "'polices': unknown key"),
        ("neighbours = 3", "neighbours = -3", "'evidence.neighbours'"),
        ("time_s = 120.0", "time_s = -1.0", "'limits.time_s'"),
        ('"stack.landing:Lander"', '"Lander"', "expected 'module:class'"),
    ],
)
def test_a_broken_file_names_source_and_key(old: str, new: str, words: str) -> None:
    text = dump_case(case())
    assert old in text
    with pytest.raises(ScenarioError, match=words) as caught:
        parse_case(text.replace(old, new), load_map, source="lawn-x.toml")
    assert "lawn-x.toml" in str(caught.value)


def test_the_name_tells_map_type_and_subject_and_differs_between_scenarios() -> None:
    first, other = case(), case(signature="IV:dog:descent:seen")
    assert first.id.startswith("lawn-IV-dog-")
    assert len(first.id) == len("lawn-IV-dog-") + 6
    assert first.id != other.id
    fixed = dataclasses.replace(first, status="fixed")
    assert fixed.id == first.id
    assert case(signature="V:PlannerError@planning_ego").id.startswith("lawn-V-PlannerError-")
    assert case(signature="I?:unknown").id.startswith("lawn-I-unknown-")
