"""The paper's tables beside those of this code."""

from __future__ import annotations

import dataclasses

from lab.experiment.spec import read_experiment
from lab.paper_tables import PAGE, SPEC, tables, with_tables
from tests.lab.experiment.samples import row

EXPERIMENT = dataclasses.replace(read_experiment(SPEC), budget=400)
MM = {"system": "MM-MLS", "budget": 400}


def test_the_page_holds_the_tables_of_its_rows() -> None:
    page = PAGE.read_text()
    assert page == with_tables(page), "run: python -m lab.paper_tables"


def test_figures_stand_beside_those_of_the_paper() -> None:
    rows = [
        row(**MM, method="garl-paper", its_code=80, paper=120, violations=40, type_iv=20),
        row(**MM, method="random", its_code=60, paper=80, violations=60, its_top10=None),
    ]
    text = tables(EXPERIMENT, rows)
    assert text.startswith("2 of 84 searches of 400 flights are flown.")
    lines = text.splitlines()
    assert "| court | MM-MLS | garl-paper | 20.6 | 20.0 | 30.0 | 10.0 | 0.2 | 0.5 | 5.0 |" in text
    (own,) = [line for line in lines if line.startswith("| court | random |")]
    assert own.startswith(
        "| court | random | 9.37 / 15.0 | 20.0 | 15.0 | 205 / 401 | 0.13 / 0.12 |"
    )
    (other,) = [line for line in lines if line.startswith("| lawn | random |")]
    assert other.startswith("| lawn | random | 8.52 / – | – | – | 112 / – |")


def test_rivals_are_paired_by_map_and_seed() -> None:
    rows = [
        row(**MM, map=map, seed=seed, method=method, its_code=its_code)
        for method, its_code in (("garl-paper", 120), ("random", 80))
        for map in ("court", "lawn")
        for seed in (0, 1, 2)
    ]
    rows.append(row(**MM, seed=0, method="ga", its_code=120))
    lines = tables(EXPERIMENT, rows).splitlines()
    # Of the 64 ways to flip the signs of six equal differences two are as extreme.
    assert any(
        line.startswith("| garl-paper | random | 6 | +10.0 (0.03) | +0.0 (1.00) |")
        for line in lines
    )
    assert any(line.startswith("| garl-paper | ga | 1 | +0.0 (1.00) |") for line in lines)
    assert not any(line.startswith("| garl-paper | online-rl | 0") for line in lines)
