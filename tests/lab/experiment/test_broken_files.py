"""Hostile and oversized experiments and rows: one short message each."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pytest_garl.errors import ScenarioError
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
