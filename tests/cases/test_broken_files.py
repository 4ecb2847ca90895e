"""Hostile and oversized cases and baselines: one short message each, on their own entry."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.cases.case_file import dump_case, load_case, parse_case
from pytest_garl.cases.case_header import load_header
from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.maps.loading import load_map
from tests.cases.samples import SYSTEM, case

TEXT = dump_case(case())
MOVES = "[[2, 0.0, 0.0], [1, 0.6, -0.8]]"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (MOVES, "[[10000, 0.0, 1.0]]", "found .10000, 0.0, 1.0. after 0 moves, .* most 600"),
        (MOVES, f"[{'[10000, 0.0, 1.0], ' * 20_000}]", "expected at most 600 moves in all"),
        (MOVES, "[[600, 0.0, 1.0], [1, 0.0, 1.0]]", "after 600 moves, expected at most 600"),
        ("0.6, -0.8", f"{'9' * 400}, -0.8", r"found \[1, 9+...9+, -0.8\], expected a list"),
        ("0.6, -0.8", "1e200, -0.8", "found .1, 1e.200, -0.8., expected a list"),
        ("[1, 0.6", f"[0x{'f' * 5000}, 0.6", "found list too long to be shown"),
        ("margin = 0.0", f"margin = {'9' * 400}", "'violation.margin': found 999"),
        ("time_s = 120.0", "time_s = 300.5", "'limits.time_s': found 300.5, .* from 0 to 300$"),
        ("distance_m = 0.75", "distance_m = 1001", "'limits.distance_m': found 1001"),
        (SYSTEM, "../../x:Straight", "'system': found '../../x:Straight', expected 'module:cl"),
        (SYSTEM, ".x:Straight", "'system': found '.x:Straight', expected 'module:class'"),
        (SYSTEM, "x:Straight()", "'system': found"),
        (SYSTEM, "x y:Straight", "'system': found"),
        ('map = "lawn"', 'map = "../../../etc/passwd"', "'map': unknown map '../../../etc/pass"),
        ("neighbours = 3", f"neighbours = {2**63}", "'evidence.neighbours': found 9223"),
    ],
)
def test_oversized_values_and_foreign_paths_are_refused(old: str, new: str, words: str) -> None:
    assert old in TEXT
    with pytest.raises(ScenarioError, match=words) as caught:
        parse_case(TEXT.replace(old, new), load_map, source="lawn-x.toml")
    assert "lawn-x.toml" in str(caught.value)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("system", ["a-b.c_d.2nd:Outer.Inner", "stack:Länder"])
def test_importable_system_names_are_accepted(system: str) -> None:
    text = TEXT.replace(SYSTEM, system)
    assert parse_case(text, load_map).system == system


def test_escape_sequences_in_a_case_are_written_out() -> None:
    text = TEXT.replace("A dog. It bites.", "A \\u001b[2Jdog.\\u202e")
    assert parse_case(text, load_map).violation.description == "A \\x1b[2Jdog.\\u202e"


def test_size_limit_holds_for_case_and_header(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(TEXT + "#" * 1_000_000)
    for read in (load_case, load_header):
        with pytest.raises(ScenarioError, match="bytes, expected at most 1000000"):
            read(tmp_path / "a.toml")
