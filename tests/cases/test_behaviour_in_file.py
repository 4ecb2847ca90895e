from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.cases.case_file import dump_case, parse_case
from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.maps.loading import load_map
from tests.cases.samples import OBJECT_NAMES, case, case_with_changes

TEXT = dump_case(case())
MOVES = "[[2, 0.0, 0.0], [1, 0.6, -0.8]]"


def test_moves_are_written_as_runs() -> None:
    assert f"{OBJECT_NAMES[-1]} = [[2, 0.0, 0.0], [1, 0.6, -0.8]]" in dump_case(case())


def test_file_keeps_negative_zeros() -> None:
    plain = dataclasses.replace(
        case(), moves=((OBJECT_NAMES[-1], ((0.0, 0.0), (0.0, -0.0), (-0.0, 0.0))),)
    )
    again = parse_case(dump_case(plain), load_map)
    assert repr(again.moves) == repr(plain.moves)
    assert again.id == plain.id


def test_changes_of_an_unknown_object_are_refused() -> None:
    text = dump_case(case_with_changes()).replace(
        f'{OBJECT_NAMES[-1]} = [[0, "env', 'cat-1 = [[0, "env'
    )
    with pytest.raises(ScenarioError, match=r"'changes.cat-1': unknown key"):
        parse_case(text, load_map)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[0, ", "[-1, "),
        ("[0, ", "[0.5, "),
        ('"environment.fog"', '"wind.mean_mps"'),
        ("0.01]", "nan]"),
        ("0.01]", '"a little"]'),
        ("0.01]", "0.01, 3]"),
    ],
)
def test_error_of_invalid_changes_names_source_and_key(old: str, new: str) -> None:
    text = dump_case(case_with_changes())
    start = text.index("[changes]")
    broken = text[:start] + text[start:].replace(old, new, 1)
    key = f"changes.{OBJECT_NAMES[-1]}"
    words = rf"lawn-x.toml: key '{key}': found .* expected a list of \[decision, gene"
    with pytest.raises(ScenarioError, match=words):
        parse_case(broken, load_map, source="lawn-x.toml")


def test_moves_of_the_longest_flight_are_accepted() -> None:
    found = parse_case(TEXT.replace(MOVES, "[[599, 0.0, 0.0], [1, 0.6, -0.8]]"), load_map)
    assert len(dict(found.moves)[OBJECT_NAMES[-1]]) == 600


def test_change_after_the_longest_flight_is_refused() -> None:
    text = dump_case(case_with_changes())
    assert parse_case(text.replace("[[0, ", "[[599, "), load_map)
    with pytest.raises(ScenarioError, match=r"found \[600, 'environment.fog', 0.01\], expected"):
        parse_case(text.replace("[[0, ", "[[600, "), load_map)
    with pytest.raises(ScenarioError, match=r"found \[0, 'environment.fog', 999"):
        parse_case(text.replace("0.01]", f"{'9' * 400}]", 1), load_map)
