from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lab.experiment.report import write_report
from lab.experiment.results import ResultRow
from lab.experiment.spec import Experiment, read_experiment
from tests.lab.experiment.samples import row

TEXT = """
title = "Mine"
text = "What it is for."
budget = 40
maps = ["court"]
seeds = [0, 1]
[systems]
Lander = "test_it.py"
[[grids]]
name = "RQ2"
title = "Methods"
text = "What is asked."
remarks = "What came of it."
methods = ["garl", "random", "ga"]
"""
GARL = (
    row(),
    row(
        seed=1,
        violations=14,
        top10=20,
        covered=90,
        signatures=("I:decoy:transit", "II:lost:descent", "IV:bird:descent:seen"),
        kind_counts=(7, 6, 1),
    ),
)
RANDOM = (
    row(
        method="random",
        violations=4,
        top10=None,
        covered=30,
        signatures=("II:lost:descent",),
        kind_counts=(4,),
        parameter_distance=1.2,
        policy="waypoint",
        policy_sha256="",
    ),
    row(
        method="random",
        seed=1,
        violations=6,
        top10=None,
        covered=60,
        kind_counts=(1, 5),
        parameter_distance=1.3,
    ),
)


@pytest.fixture
def experiment(tmp_path: Path) -> Experiment:
    (tmp_path / "mine.toml").write_text(TEXT)
    return read_experiment(tmp_path / "mine.toml")


def report(experiment: Experiment, rows: tuple[ResultRow, ...]) -> str:
    path = experiment.file.parent / "out" / "mine.md"
    assert write_report(experiment, rows, "mine.csv", path) == path
    return path.read_text()


def test_tables_show_measured_figures(experiment: Experiment) -> None:
    text = report(experiment, GARL + RANDOM)
    # 10 and 14 of 40 violate; 7,200 s on two workers are an hour.
    assert (
        "| court | Lander | garl | 0, 1 | 65.0 | 30.0 (25.0, 35.0) | 30.0 (30.0, 30.0) | 10.0 "
        "| 2.5 | 2.5 | 5.0 | 0.75 m, 120 s, abort needless | 30, 20 | 1.00 |"
    ) in text
    assert (
        "| court | Lander | garl | 1.50 | 1.25 | 0.125 | 4.00 | 2, 3 (4 in all) "
        "| 2, 3 (4 in all) | 2.0, 2.5 | 2.0, 2.4 in 6 |"
    ) in text
    # The other search of random has but four violations, less than the least of five.
    assert "| 1, 2 (2 in all) | 1, 2 (2 in all) | 1.0, 1.6 | –, 2.0 in 6 |" in text
    assert "| –, – | 1.00 |" in text
    assert "| court | Lander | ga | not run | – | – |" in text


def test_searches_of_different_definitions_are_not_compared(experiment: Experiment) -> None:
    others = tuple(replace(each, limits="1.5 m, 120 s, abort violation") for each in RANDOM)
    assert "garl against" in report(experiment, GARL + RANDOM)
    assert "garl against" not in report(experiment, GARL + others)


def test_methods_are_compared_over_seeds(experiment: Experiment) -> None:
    text = report(experiment, GARL + RANDOM)
    # Two against two, all on one side: 2 of 6 deals are as extreme. 41 stands for no tenth.
    assert (
        "| court | Lander | random | 2, 2 | U 4, p 0.33, A12 1.00 | U 2, p 1.00, A12 0.50 "
        "| U 0, p 0.33, A12 0.00 | U 4, p 0.33, A12 1.00 | U 4, p 0.33, A12 1.00 "
        "| U 3.5, p 0.67, A12 0.88 |"
    ) in text
    assert "garl against" not in report(experiment, GARL[:1] + RANDOM)


def test_effective_kinds_are_compared_with_holms_correction(experiment: Experiment) -> None:
    ga = tuple(replace(each, method="ga") for each in RANDOM)
    text = report(experiment, GARL + RANDOM + ga)
    # Two comparisons of one system: p is doubled.
    for other in ("random", "ga"):
        assert (
            f"| court | Lander | {other} | 2, 2 | 2.2, 1.3 | U 4, p 0.33, A12 1.00 | 0.67 |"
        ) in text
    assert "p by Holm |" not in report(experiment, GARL[:1] + RANDOM)


def test_the_report_lists_flown_and_missing_runs(experiment: Experiment) -> None:
    text = report(experiment, GARL + RANDOM[:1] + (row(seed=7), row(budget=400)))
    assert (
        "- RQ2: 3 of 6 searches of 40 flights: Lander on court by garl, random, ga; seeds 0, 1"
        in text
    )
    assert "- Lander, ga, on court: seed 0, 1\n- Lander, random, on court: seed 1" in text
    assert "- pytest-garl 0.1.0, sources dddddddddddd (3 searches)" in text
    assert "- Lander: `stack.lander:Lander`, sources aaaaaaaaaaaa (3 searches)" in text
    assert "- random: objects moved by waypoint (1 search)" in text
    assert "more than one state" not in text
    assert "**These searches are from more than one state of pytest-garl.**" in report(
        experiment, (GARL[0], row(seed=1, package_sha256="0"))
    )


def test_a_new_report_keeps_remarks(experiment: Experiment) -> None:
    for rows in (GARL, GARL + RANDOM):
        text = report(experiment, rows)
        places = [
            text.index(words) for words in ("What it is for.", "What is asked.", "What came of it.")
        ]
        assert places == sorted(places)


def test_equal_rows_make_equal_bytes(experiment: Experiment) -> None:
    assert report(experiment, tuple(reversed(GARL + RANDOM))) == report(experiment, GARL + RANDOM)


def test_a_report_without_rows_says_not_run(experiment: Experiment) -> None:
    text = report(experiment, ())
    assert "RQ2: 0 of 6 searches" in text
    assert "| court | Lander | garl | not run |" in text
    assert "Flown with" not in text
