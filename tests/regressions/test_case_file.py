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
from tests.regressions.samples import LAWN, OBJECT_NAMES, case, case_with_changes

ROOT = Path(__file__).parents[2]


def test_file_keeps_a_case_and_its_bytes() -> None:
    text = dump_case(case())
    assert parse_case(text, load_map) == case()
    assert dump_case(parse_case(text, load_map)) == text


COMMITTED = [
    path
    for folder in ("scenarios/regressions", "docs/tutorial/scenarios/regressions")
    for path in sorted((ROOT / folder).glob("*/*.toml"))
]


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: path.stem)
def test_committed_case_keeps_its_bytes_and_its_name(path: Path) -> None:
    committed = load_case(path)
    assert dump_case(committed) == path.read_text(encoding="utf-8")
    assert committed.id == path.stem


@settings(deadline=None)
@given(st.text())
def test_file_keeps_any_description(description: str) -> None:
    strange = case(description=description)
    assert parse_case(dump_case(strange), load_map) == case(description=printable(description))


def test_file_keeps_destinations() -> None:
    genome = with_destinations(genome_for(LAWN))
    row = genome.random(np.random.default_rng(1))
    scenario = repair(decode(row, genome, map="lawn", seed=9), LAWN).without(*OBJECT_NAMES[:-1])
    bound = dataclasses.replace(case(), scenario=scenario, policy="destination")
    assert parse_case(dump_case(bound), load_map) == bound


def test_file_keeps_changes_of_the_environment() -> None:
    text = dump_case(case_with_changes())
    assert (
        f'{OBJECT_NAMES[-1]} = [[0, "environment.fog", 0.01], [2, "environment.sun_position"'
        in text
    )
    assert parse_case(text, load_map) == case_with_changes()
    assert dump_case(parse_case(text, load_map)) == text
    assert case_with_changes().id != case().id
    assert "[changes]" not in dump_case(case())


def test_file_keeps_names_with_quotes_and_backslashes() -> None:
    strange = dataclasses.replace(case(), system="stack:Länder", test='te"st.py::test\\it')
    odd = dataclasses.replace(LAWN, name='la"wn\\')
    strange = dataclasses.replace(
        strange, scenario=dataclasses.replace(strange.scenario, map=odd.name)
    )
    assert parse_case(dump_case(strange), lambda _: odd) == strange


def test_file_keeps_the_test_and_the_hashes_of_the_sources() -> None:
    plain = case()
    evidence = dataclasses.replace(
        plain.evidence, system_sha256="ef" * 32, simulator_sha256="12" * 32
    )
    with_node_id = dataclasses.replace(
        plain, test="tests/test_it.py::TestIt::test_a", evidence=evidence
    )
    assert parse_case(dump_case(with_node_id), load_map) == with_node_id
    assert with_node_id.id == plain.id
    assert with_node_id.asserting_test == ""


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
def test_error_of_a_broken_file_names_source_and_key(old: str, new: str, words: str) -> None:
    text = dump_case(case())
    assert old in text
    with pytest.raises(ScenarioError, match=words) as caught:
        parse_case(text.replace(old, new), load_map, source="lawn-x.toml")
    assert "lawn-x.toml" in str(caught.value)
