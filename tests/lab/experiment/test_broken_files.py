"""Hostile and oversized experiments and rows: one short message each."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import pytest

from lab.experiment.results import append_rows, read_rows
from pytest_garl.errors import ExperimentError, ScenarioError
from tests.lab.experiment.samples import row
from tests.lab.experiment.test_spec import TEXT, plan


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("budget = 40", "budget = 1000001", "'budget': found 1000001, .* from 1 to 1000000$"),
        ("budget = 40", f"budget = {'9' * 5000}", "not valid TOML: Exceeds the limit"),
        ("seeds = [3, 4]", f"seeds = [{2**63}]", r"'seeds': found \[9223372036854775808\], exp"),
        ("seeds = [3, 4]", f"seeds = {list(range(10_000))}", "'grids': found 20008 searches"),
        ('"Two"', '"\\u001b[2J"', r"'grids\[1\].systems': found '\\\\x1b\[2J', expected some"),
        ('name = "RQ1"', f'name = "{"x" * 5000}/"', "'grids.0..xxx"),
        (
            "[[grids]]",
            '[[grids]]\nname = "RQ1"\nmethods = ["garl"]\n' * 100 + "[[grids]]",
            "'grids': found 102 tables, expected at most 100",
        ),
    ],
)
def test_a_damaged_experiment_file_is_one_short_error(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert old in TEXT
    with pytest.raises(ScenarioError, match=words) as caught:
        plan(tmp_path, TEXT.replace(old, new, 1))
    assert "mine.toml" in str(caught.value)
    assert len(str(caught.value)) < 600


def test_an_experiment_file_that_is_a_pipe_is_refused(tmp_path: Path) -> None:
    from lab.experiment.spec import read_experiment

    os.mkfifo(tmp_path / "mine.toml")
    with pytest.raises(ScenarioError, match="found a pipe, expected a regular file"):
        read_experiment(tmp_path / "mine.toml")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    append_rows(tmp_path / "rows.csv", [row()])
    return tmp_path / "rows.csv"


@pytest.mark.parametrize("line", [0, 1])
def test_a_cell_too_large_for_the_reader_is_refused(file: Path, line: int) -> None:
    lines = file.read_text().splitlines()
    lines[line] = "x" * (csv.field_size_limit() + 1) + lines[line]
    file.write_text("\n".join(lines))
    with pytest.raises(ExperimentError, match=r"rows.csv, line .*: not valid CSV: field larger"):
        read_rows(file)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (",40,", ",-40,", "column 'budget': found '-40', expected a whole number from 0$"),
        (",40,", f",{'9' * 5000},", "column 'budget': found '999.*999', expected a whole number"),
        (",40,", f",{2**63},", "column 'budget': found '92233720"),
        ("system", "x" * 100_000, "found other columns than expected: "),
    ],
)
def test_a_damaged_cell_is_one_short_error(file: Path, old: str, new: str, words: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(ExperimentError, match=words) as caught:
        read_rows(file)
    assert len(str(caught.value)) < 1100


def test_escape_sequences_in_a_row_are_made_visible(file: Path) -> None:
    file.write_text(file.read_text().replace("Lander", "L\x1b[2Jander", 1))
    assert read_rows(file)[0].system == "L\\x1b[2Jander"


@pytest.mark.parametrize(("target", "words"), [("gone", "No such file"), ("rows.csv", "Too many")])
def test_a_broken_link_to_rows_is_refused(tmp_path: Path, target: str, words: str) -> None:
    (tmp_path / "rows.csv").symlink_to(target)
    with pytest.raises(ExperimentError, match=f"rows.csv: cannot be read: {words}"):
        read_rows(tmp_path / "rows.csv")
