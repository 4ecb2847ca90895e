from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import pytest_garl
from lab.experiment.__main__ import experiment
from lab.experiment.results import ResultRow, read_rows
from lab.experiment.spec import read_experiment
from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from tests.plugin.test_resume import FLOWN, SLOW, query
from tests.support.landing_project import write_project

TEXT = """
title = "Toy"
budget = 12
maps = ["lawn", "court"]
seeds = [0]
[systems]
Good = "test_it.py"
[[grids]]
name = "RQ2"
methods = ["garl", "random"]
"""
SOURCES = Path(pytest_garl.__file__).parents[1]
SLOWER = SLOW.replace("0.03", "0.3")
"""Flights so slow that a run lasts until a test on a busy machine has seen some and stops it."""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a project with an experiment on the analytic simulator; it is the working folder."""
    write_project(tmp_path, maps="['court', 'lawn']")
    (tmp_path / "toy.toml").write_text(TEXT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(SOURCES))
    return tmp_path


def garl(*args: str) -> Result:
    return CliRunner().invoke(experiment, ["toy.toml", *args], env={"COLUMNS": "120"})


def change(project: Path, before: str, after: str) -> None:
    assert before in TEXT
    (project / "toy.toml").write_text(TEXT.replace(before, after))


def without_times(rows: tuple[ResultRow, ...]) -> list[tuple[object, ...]]:
    """Return the rows without the columns that depend on the duration of flights."""
    return [(*row.key, row.violations, row.top10, row.covered, row.result_hash) for row in rows]


def test_each_run_is_flown_once_and_reported_from_its_rows_alone(project: Path) -> None:
    result = garl("--workers=1", "--out=out", "--folder=runs")
    assert result.exit_code == 0, result.output
    assert "run 2 of 2: Good, random, seed 0, 12 flights on lawn and court" in result.output
    assert "    court: " in result.output
    assert "all 2 runs are in out/toy.csv" in result.output
    rows = read_rows(project / "out" / "toy.csv")
    order = [(row.method, row.map) for row in rows]
    assert order == [(method, map) for method in ("garl", "random") for map in ("lawn", "court")]
    assert not list(project.rglob("*.npz"))
    shutil.rmtree(project / "runs")
    assert "run 1" not in garl("--out=out", "--folder=runs").output
    change(project, "seeds = [0]", "seeds = [0, 1]")
    longer = garl("--workers=1", "--out=out", "--folder=runs")
    assert "run 3 of 4: Good, garl, seed 1" in longer.output
    assert read_rows(project / "out" / "toy.csv")[: len(rows)] == rows
    shutil.rmtree(project / "runs")
    result = garl("--report", "--out=out")
    assert result.output.strip() == "wrote out/toy.md"
    text = (project / "out" / "toy.md").read_text()
    assert "RQ2: 8 of 8 searches of 12 flights" in text
    assert "| lawn | Good | random | 2, 2 | U " in text
    assert garl("--report").output.strip() == "wrote toy.md"
    assert "RQ2: 0 of 8 searches" in (project / "toy.md").read_text()


def test_rows_hold_the_figures_of_the_ledger(project: Path) -> None:
    change(project, 'methods = ["garl", "random"]', 'methods = ["garl"]')
    # A run that is killed while it creates its ledger leaves an empty file.
    (run,) = read_experiment(Path("toy.toml")).runs
    path = project / ".garl" / "experiments" / run.folder / "ledger.sqlite"
    path.parent.mkdir(parents=True)
    path.touch()
    result = garl("--workers=2")
    assert result.exit_code == 0, result.output
    row, _ = read_rows(project / "toy.csv")
    assert row.map == "lawn"
    ledger = Ledger(path)
    search, _ = next(each for each in ledger.searches() if '"map": "lawn"' in each[1])
    flights, map = ledger.queries.flights(search), load_map("lawn")
    assert len(flights) == row.budget == 12
    bad = [flight for flight in flights if flight.result.verdict.violation]
    assert row.violations == len(bad) > 0
    assert row.type_iv == sum(f.signature.startswith("IV:") for f in flights)
    assert set(row.signatures) == {flight.signature for flight in bad}
    # The analytic simulator's UAV starts 12 m above its landing place: two cells in each flight.
    cells = set()
    for flight in bad:
        x, y = Placed(parse_scenario(flight.scenario), map).marker_m
        off = flight.result.final_distance_m
        # Places beyond the lawn are in no cell.
        if abs(x + off) < 10:
            cells |= {((x + off) // 2, y // 2, z) for z in (0, 6)}
    assert row.covered == len(cells)
    assert row.cells == 10 * 20 * 15
    genome = genome_for(map)
    genes = [genome.normalise(encode(parse_scenario(f.scenario), genome)) for f in flights]
    pairs = [float(np.linalg.norm(a - b)) for a in genes for b in genes]
    assert row.parameter_distance == pytest.approx(np.mean(pairs), abs=1e-4)
    weather = np.array(genes)[:, :8] * 0.15
    pairs = [float(np.linalg.norm(a - b)) for a in weather for b in weather]
    assert row.weather_distance == pytest.approx(np.mean(pairs), abs=1e-4)
    verdicts = [flight.result.verdict for flight in flights]
    assert row.limits == "0.75 m, 120 s, abort needless"
    assert row.landed == sum(verdict.completed for verdict in verdicts)
    assert row.paper == sum(verdict.paper_violation for verdict in verdicts)
    assert row.policy == "dqn"
    assert row.landing_system == "systems:Good"
    assert row.package_sha256 == ledger.facts.package_sha256


def test_a_shorter_search_of_equal_population_is_the_beginning_of_a_longer_one(
    project: Path,
) -> None:
    # But for garl, whose children begin at a flight that depends on the budget.
    flown = []
    for budget in (12, 8):
        change(project, 'methods = ["garl", "random"]', 'methods = ["garl-paper"]')
        text = (project / "toy.toml").read_text()
        text = text.replace("budget = 12", f"budget = {budget}\npopulation = 4")
        (project / "toy.toml").write_text(text)
        result = garl("--workers=2", f"--out=out-{budget}")
        assert result.exit_code == 0, result.output
        (run,) = read_experiment(Path("toy.toml")).runs
        ledger = Ledger(project / ".garl" / "experiments" / run.folder / "ledger.sqlite")
        search, _ = next(each for each in ledger.searches() if '"map": "lawn"' in each[1])
        flown.append([each.scenario for each in ledger.queries.flights(search)])
    longer, shorter = flown
    assert len(longer) == 12
    assert shorter == longer[:8]


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('"test_it.py"', '"test_no.py"', "key 'systems.Good': found 'test_no.py', expected tests"),
        ('"court"]', '"moon"]', "key 'maps': unknown map 'moon'; expected one of court, "),
        ('"random"]', '"luck"]', "key 'methods': search method 'luck': cannot be loaded"),
        ('"garl", "random"', '"nowhere:Luck"', "pytest ended with status 4; its output is in"),
        ("budget = 12", "budget = 1.5", "toy.toml: key 'budget': found 1.5, expected a whole"),
    ],
)
def test_an_experiment_that_cannot_be_flown_is_refused(
    project: Path, before: str, after: str, words: str
) -> None:
    change(project, before, after)
    result = garl("--workers=1")
    assert result.exit_code == 1
    assert words in result.output
    if "nowhere" in after:
        assert "--garl-method: search method 'nowhere:Luck'" in result.output


def test_tests_that_do_not_name_the_map_are_refused(project: Path) -> None:
    write_project(project, maps="['court']")
    change(project, "budget = 12", "budget = 1")
    result = garl("--workers=1")
    assert result.exit_code == 1
    assert "found 0 flights on lawn in .garl/experiments/Good-garl-" in result.output
    assert "do the tests in test_it.py name this map?" in result.output
    assert not (project / "toy.csv").exists()


def test_two_landing_systems_in_one_run_are_refused(project: Path) -> None:
    change(project, '"test_it.py"', '"."')
    text = (project / "toy.toml").read_text().replace("budget = 12", "budget = 1")
    (project / "toy.toml").write_text(text)
    other = (project / "test_it.py").read_text().replace("system=Good", "system=Raises")
    (project / "test_that.py").write_text(other)
    result = garl("--workers=1")
    assert result.exit_code == 1
    assert "found more than one landing system with tests on" in result.output


@pytest.fixture
def slow_project(project: Path) -> Path:
    """Return a project whose flights take a while, with one run."""
    (project / "systems.py").write_text(SLOWER)
    text = (project / "test_it.py").read_text().replace("system=Good", "system=Slow")
    (project / "test_it.py").write_text(text)
    change(project, 'methods = ["garl", "random"]', 'methods = ["garl"]')
    return project


def start() -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "lab.experiment", "toy.toml", "--workers=2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_flights(project: Path, flights: int, process: subprocess.Popen[str]) -> Path:
    for _ in range(6000):
        for ledger in project.glob(".garl/experiments/*/ledger.sqlite"):
            done = query(ledger, f"SELECT count(*) {FLOWN}")
            if done and done[0][0] >= flights:
                return ledger
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    raise AssertionError("nothing was flown in 60 s")


def flown(ledger: Path) -> int:
    return query(ledger, f"SELECT count(*) {FLOWN}")[0][0]


@pytest.mark.long
def test_an_interrupted_or_killed_run_continues(slow_project: Path) -> None:
    assert garl("--workers=2", "--out=undisturbed", "--folder=undisturbed").exit_code == 0
    stopped = start()
    ledger = wait_for_flights(slow_project, 3, stopped)
    stopped.send_signal(signal.SIGINT)
    _, error_output = stopped.communicate(timeout=60)
    assert stopped.returncode == 130
    assert "interrupted; finished flights are kept, the same command continues" in error_output
    assert 3 <= flown(ledger) < 20
    killed = start()
    wait_for_flights(slow_project, flown(ledger) + 2, killed)
    killed.kill()
    killed.communicate()
    session = Path("/proc") / ledger.with_suffix(".lock").read_text()
    for _ in range(1000):
        if not session.exists():
            break
        time.sleep(0.01)
    assert not (slow_project / "toy.csv").exists()
    assert flown(ledger) < 24
    resumed = garl("--workers=1")
    assert resumed.exit_code == 0, resumed.output
    assert flown(ledger) == 24
    # A new run would have moved the earlier ledger aside.
    assert not list(ledger.parent.glob("ledger-previous*"))
    expected = read_rows(slow_project / "undisturbed" / "toy.csv")
    assert without_times(read_rows(slow_project / "toy.csv")) == without_times(expected)


@pytest.mark.long
def test_a_run_of_changed_code_is_refused(slow_project: Path) -> None:
    process = start()
    wait_for_flights(slow_project, 1, process)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    (slow_project / "systems.py").write_text(SLOWER + "\nchanged = True\n")
    result = garl("--workers=2")
    assert result.exit_code == 1
    assert "systems.py changed" in result.output
    assert "remove .garl/experiments/Good-garl-seed0-12-lawn-court-" in result.output
