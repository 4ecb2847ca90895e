"""A run that draws from a model of use, and what `garl risk` says of it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.test_report_command import garl
from tests.support.landing_project import write_project

USE = ("--garl-method=use", "-o", "garl_use=use.toml")
TEST = """
import pytest
from systems import Good

@pytest.mark.garl(system=Good, maps=["lawn"])
def test_it_flies(landing):
    assert landing.elapsed_s > 0
"""


def pytest_run(folder: Path, *args: str) -> str:
    """Run pytest with one worker; return what it prints."""
    command = [sys.executable, "-m", "pytest", "-q", "--garl-workers=1", "--garl-shrink=0", *args]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return " ".join((done.stdout + done.stderr).split())


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project with a run of 120 plain draws and 20 in two strata."""
    folder = tmp_path_factory.mktemp("use")
    write_project(folder)
    (folder / "test_it.py").write_text(TEST)
    (folder / "pytest.ini").write_text("[pytest]\ngarl_domain = field\n")
    (folder / "use.toml").write_text(garl(folder, "domain", "use", "field"))
    shown = pytest_run(folder, "--garl-budget=140", "--garl-population=20", *USE)
    assert "in 120 plain flights" in shown, shown
    return folder


def test_a_run_tells_how_often_landings_fail_and_where(flown: Path) -> None:
    (risk,) = json.loads(garl(flown, "risk", "--json"))
    assert [(each["how"], each["flights"]) for each in risk["parts"]] == [
        ("use", 120),
        ("outside", 10),
        ("inside", 10),
    ]
    assert sum(each["failing"] for each in risk["parts"]) == risk["failing"]
    found = risk["probability"]
    # Fog of 100 m and less in 9 % of landings, and a fast dog in 3 %.
    assert found["low"] < 0.09 + 0.91 * 0.03 < found["high"]
    (first, *_) = risk["kinds"]
    assert first["kind"] == "any failure"
    assert first["rule"].startswith("fog visibility below ")
    assert first["hits"] > 0.8 * first["covered"]


def test_the_risk_in_words_names_its_sample(flown: Path) -> None:
    shown = garl(flown, "risk")
    assert "of landings fail [" in shown
    assert "%] (95 %), from 140 flights" in shown
    assert " of 120 fail: plain draws\n" in shown
    assert " of 10 fail: in the predicted region, 25.0 % of landings\n" in shown
    assert "any failure: fog visibility below " in shown


def test_a_run_is_not_resumed_with_another_model_of_use(flown: Path) -> None:
    text = (flown / "use.toml").read_text()
    (flown / "other.toml").write_text(text.replace("share = 0.1", "share = 0.2", 1))
    options = ("--garl-budget=140", "--garl-population=20", "--garl-method=use", "--garl-resume")
    shown = pytest_run(flown, *options, "-o", "garl_use=other.toml")
    assert "belongs to another run: model of use " in shown


def test_a_run_without_a_sample_of_use_says_what_to_run(flown: Path) -> None:
    pytest_run(flown, "--garl-budget=8", "--garl-method=random", "-o", "garl_dir=random")
    shown = garl(flown, "risk", "random/ledger.sqlite")
    assert "how often landings fail: unknown" in shown
    assert "--garl-method=use" in shown


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("--garl-method=use",), "garl_use: found no file, expected that of the model of use"),
        (("--garl-method=use", "-o", "garl_use=no.toml"), "garl_use: found "),
    ],
)
def test_a_missing_model_of_use_is_one_usage_error(
    flown: Path, args: tuple[str, ...], message: str
) -> None:
    shown = pytest_run(flown, "--garl-budget=8", *args)
    assert f"ERROR: {message}" in shown
    assert "Traceback" not in shown


def test_a_model_that_does_not_fit_the_domain_ends_the_run_with_its_key(flown: Path) -> None:
    shown = pytest_run(flown, "--garl-budget=8", "--garl-domain=calm", *USE, "-o", "garl_dir=calm")
    assert "use.toml: key 'light.sun_elevation_deg': found [-2.5, 60], expected values" in shown
