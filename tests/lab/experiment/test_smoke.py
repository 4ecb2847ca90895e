from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from lab.experiment.results import read_rows

ROOT = Path(__file__).parents[3]
PLAN = "docs/results/experiments/smoke.toml"


def test_make_runs_the_experiment_tested_here() -> None:
    recipe = (ROOT / "Makefile").read_text().partition("\nexperiment-smoke:")[2]
    assert recipe.partition("\n\n")[0].count(f"python -m lab.experiment {PLAN} --out=$(SMOKE)") == 2


@pytest.mark.sim
@pytest.mark.long
def test_a_toy_experiment_is_flown_measured_and_reported(tmp_path: Path) -> None:
    def experiment(*words: str) -> None:
        command = [sys.executable, "-m", "lab.experiment", PLAN, f"--out={tmp_path}", *words]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr

    experiment(f"--folder={tmp_path / 'runs'}")
    rows = read_rows(tmp_path / "smoke.csv")
    assert [(row.method, row.policy, row.seed) for row in rows] == [
        ("garl", "dqn", 0),
        ("random with dqn", "dqn", 0),
        ("garl", "dqn", 1),
        ("random with dqn", "dqn", 1),
    ]
    for row in rows:
        assert row.budget == 3
        assert row.flying_s > 0
        assert row.weather_distance < row.parameter_distance
        # Whoever violates was somewhere.
        assert (row.covered > 0) == (row.violations > 0) == bool(row.signatures)
        assert row.limits
        assert sum(row.kind_counts) == row.violations
        assert row.landed + row.paper <= row.budget
    experiment("--report")
    text = (tmp_path / "smoke.md").read_text()
    assert "Toy: 4 of 4 searches of 3 flights" in text
