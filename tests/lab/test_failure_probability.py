"""The check of the failure probability: its truth, its searches, and the project that it flies."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lab import failure_probability as study
from lab.failure_probability import ARMS, Flights, estimate, fly, pools, row_of
from lab.stand_in import stand_in
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.use_file import read_use


@pytest.fixture(scope="module")
def pool() -> Flights:
    with ThreadPoolExecutor(1) as executor:
        return pools(150, executor)["ordinary"]


def test_draws_are_flown_by_every_landing_and_some_fail(pool: Flights) -> None:
    assert pool.rows.shape[0] == len(pool.violates) == len(pool.proximity) == 150
    assert 0.03 < np.mean(pool.violates) < 0.4


@pytest.mark.parametrize("arm", ARMS)
def test_a_search_of_each_arm_estimates_the_share_that_fails(
    pool: Flights, arm: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study, "MEASURED", 300)
    known = pool if arm == "archive" else None
    found = estimate(pool, arm, np.random.default_rng(3), known)
    assert found.found.low < np.mean(pool.violates) < found.found.high
    assert (found.region_share == 0) == (arm == "direct")


def test_a_row_counts_the_intervals_that_hold_the_truth(pool: Flights) -> None:
    row = row_of("ordinary", "direct", pool, 40, [])
    assert row["covered"] + row["too_low"] + row["too_high"] == row["searches"] == 40
    assert row["covered"] >= 34
    assert float(row["truth"]) == pytest.approx(np.mean(pool.violates), abs=1e-4)


def test_the_project_that_is_flown_goes_on_where_it_was_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands: list[list[str]] = []

    class Done:
        returncode = 0

    def noted(command: list[str], **_: object) -> Done:
        commands.append(command)
        return Done()

    monkeypatch.setattr("lab.failure_probability.subprocess.run", noted)
    folder = tmp_path / "flown"
    assert fly(folder, 30, 1, 2, plain=True) == 0
    assert "--garl-population=30" in commands[0]
    assert "--garl-resume" not in commands[0]
    assert read_use(folder / "use.toml").sections["fog"].values["share"] == 0.1
    (folder / ".garl").mkdir()
    (folder / ".garl" / "ledger.sqlite").touch()
    fly(folder, 30, 1, 2, plain=False)
    assert "--garl-resume" in commands[1]
    assert "--garl-population=30" not in commands[1]


def test_searches_draw_from_the_flights_of_a_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    drawn = [
        decode(row, study.GENOME, map="lawn", seed=7) for row in study.example_model().rows(60, rng)
    ]
    flights = [
        SimpleNamespace(
            scenario=dump_scenario(each),
            result=stand_in(each, study.MAP, study.LANDINGS["ordinary"]),
        )
        for each in drawn
    ]

    class Stored:
        def __init__(self, path: Path) -> None:
            assert path == Path("truth/.garl/ledger.sqlite")
            self.queries = SimpleNamespace(flights=lambda: flights)

        def close(self) -> None:
            pass

    monkeypatch.setattr(study, "Ledger", Stored)
    monkeypatch.setattr(study, "MEASURED", 50)
    rows = list(study.resample(Path("truth"), 3))
    failing = sum(each.result.verdict.violation for each in flights)
    assert [row["arm"] for row in rows] == ["direct", "use", "placebo"]
    assert {row["truth"] for row in rows} == {f"{failing / 60:.4f}"}
