"""Hostile and oversized cases and baselines: one short message each, on their own entry."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.baselines import file as baselines
from pytest_garl.errors import BaselineError, OptionError, ScenarioError
from pytest_garl.regressions.case_file import dump_case, load_case, load_header, parse_case
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.verdicts.verdict import Limits
from tests.baselines.samples import baseline
from tests.regressions.samples import NAMES, SYSTEM, case, case_with_changes

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
        ("distance_m = 1.5", "distance_m = 1001", "'limits.distance_m': found 1001"),
        (SYSTEM, "../../x:Straight", "'system': found '../../x:Straight', expected 'module:cl"),
        (SYSTEM, ".x:Straight", "'system': found '.x:Straight', expected 'module:class'"),
        (SYSTEM, "x:Straight()", "'system': found"),
        (SYSTEM, "x y:Straight", "'system': found"),
        ('map = "lawn"', 'map = "../../../etc/passwd"', "'map': unknown map '../../../etc/pass"),
        ("neighbours = 3", f"neighbours = {2**63}", "'evidence.neighbours': found 9223"),
    ],
)
def test_a_case_that_would_eat_the_machine_or_leave_the_tree_is_refused(
    old: str, new: str, words: str
) -> None:
    assert old in TEXT
    with pytest.raises(ScenarioError, match=words) as caught:
        parse_case(TEXT.replace(old, new), load_map, source="lawn-x.toml")
    assert "lawn-x.toml" in str(caught.value)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("system", ["a-b.c_d.2nd:Outer.Inner", "stack:Länder"])
def test_what_python_can_import_is_taken(system: str) -> None:
    text = TEXT.replace(SYSTEM, system)
    assert parse_case(text, load_map).system == system


def test_moves_for_the_longest_flight_are_taken() -> None:
    found = parse_case(TEXT.replace(MOVES, "[[599, 0.0, 0.0], [1, 0.6, -0.8]]"), load_map)
    assert len(dict(found.moves)[NAMES[-1]]) == 600


def test_a_change_of_the_environment_beyond_the_longest_flight_is_refused() -> None:
    text = dump_case(case_with_changes())
    assert parse_case(text.replace("[[0, ", "[[599, "), load_map)
    with pytest.raises(ScenarioError, match=r"found \[600, 'environment.fog', 0.01\], expected"):
        parse_case(text.replace("[[0, ", "[[600, "), load_map)
    with pytest.raises(ScenarioError, match=r"found \[0, 'environment.fog', 999"):
        parse_case(text.replace("0.01]", f"{'9' * 400}]", 1), load_map)


def test_escape_sequences_in_a_case_are_written_out() -> None:
    text = TEXT.replace("A dog. It bites.", "A \\u001b[2Jdog.\\u202e")
    assert parse_case(text, load_map).violation.description == "A \\x1b[2Jdog.\\u202e"


@pytest.mark.parametrize("value", [300.001, -1.0, float("nan"), float("inf"), "120", True])
def test_a_limit_of_time_has_a_limit(value: float) -> None:
    assert Limits(time_s=300.0).time_s == 300.0
    with pytest.raises(OptionError, match=r"limits: found time_s=.* expected a number from 0 to"):
        Limits(time_s=value)


def test_other_limits_that_make_no_sense_are_told() -> None:
    with pytest.raises(OptionError, match=r"found distance_m=-0.5, expected a number from 0 to 10"):
        Limits(distance_m=-0.5)
    with pytest.raises(OptionError, match="found abort='no', expected 'ok' or 'violation'"):
        Limits(abort="no")  # type: ignore[arg-type]


def test_the_head_of_a_case_is_read_within_the_limit(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(TEXT + "#" * 1_000_000)
    for read in (load_case, load_header):
        with pytest.raises(ScenarioError, match="bytes, expected at most 1000000"):
            read(tmp_path / "a.toml")


BASELINE = baselines.dump_baseline(baseline())


@pytest.mark.parametrize(
    ("start", "end", "new", "words"),
    [
        ("cpu = ", "\n", "[" * 3000, "nested too deeply"),
        ("distance_m = ", ",", "9" * 400, "'set.0..limits.distance_m': found 999"),
        ("flights = ", "\n]", "[[" + "9" * 400 + ', "landed", "", false, "", []]', "the seed 99"),
        ("flights = ", "\n]", '["' + "x" * 5000 + '"', r"'set\[0\].flights\[0\]': found 'xxx"),
        ("flights = ", "\n]", '[[0, "landed", "", false, "", [1]]', "found 1 values of genes"),
    ],
)
def test_a_broken_baseline_is_one_short_error(start: str, end: str, new: str, words: str) -> None:
    begin = BASELINE.index(start) + len(start)
    text = BASELINE[:begin] + new + BASELINE[BASELINE.index(end, begin) :]
    with pytest.raises(ScenarioError, match=words) as caught:
        baselines.parse_baseline(text, load_map, source="base.toml")
    assert "base.toml" in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_gene_too_large_for_a_float_is_one_error() -> None:
    row = BASELINE.index("\n  [", BASELINE.index("flights = ")) + len("\n  [")
    value = BASELINE.index("[", row) + 1
    text = f"{BASELINE[:value]}{'9' * 400}{BASELINE[BASELINE.index(',', value) :]}"
    with pytest.raises(ScenarioError, match=r"flights\[0\]': environment.dust: found 999.* to 1$"):
        baselines.parse_baseline(text, load_map, source="base.toml")


def test_no_baseline_is_saved_that_could_not_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baselines, "LARGEST_BYTES", len(BASELINE) - 1)
    with pytest.raises(BaselineError, match=r"flights in .* bytes, expected at most"):
        baselines.save_baseline(tmp_path / "base.toml", baseline())
    (tmp_path / "base.toml").write_text(BASELINE)
    with pytest.raises(ScenarioError, match=r"bytes, expected at most .* `garl baseline save`"):
        baselines.load_baseline(tmp_path / "base.toml")
