"""The text of a failing item says what happened and how to see it."""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from pytest_garl.scenarios.maps import map as map_module
from tests.support.landing_project import project, run
from tests.support.search_tests import HIT

PARALLEL = pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
SEARCH = ("--garl-budget=8", "--garl-workers=0", "-o", "garl_dir=elsewhere")
AGAIN = (
    "Repeat: pytest 'test_it.py::test_collisions[lawn-g00-s02]' --garl-repeat=lawn-g00-s02 "
    "-o garl_dir=elsewhere"
)


@PARALLEL
def test_headline_stands_where_people_look(
    pytester: pytest.Pytester, parallel: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    monkeypatch.setenv("COLUMNS", "150")
    result = run(pytester, *SEARCH, "--junitxml=out.xml", *parallel)
    text = result.stdout.str()
    assert "<Landing lawn-g00-s02>.collisions" in text
    assert AGAIN in text
    assert f"FAILED test_it.py::test_collisions[lawn-g00-s02] - {HIT}" in text
    messages = [
        str(failure.get("message"))
        for failure in ElementTree.parse(Path(pytester.path) / "out.xml").iter("failure")
    ]
    assert f"{HIT}\n{AGAIN}" in messages


def test_failure_and_summary_say_how_severe_the_violation_is(pytester: pytest.Pytester) -> None:
    project(pytester)
    output = run(pytester, *SEARCH, "--garl-shrink=0").stdout.str()
    assert "\nUnusual in this flight: a hostile dog at 0.0 m/s for " in output
    assert "It took" not in output
    assert "at the least" not in output
    assert re.search(
        r"\n        unusual in lawn-g\d\d-s\d\d: a hostile dog at 0.0 m/s for ", output
    )
    harmless = run(pytester, *SEARCH, "--garl-shrink=0", "--garl-npcs=waypoint").stdout.str()
    assert "\nUnusual in this flight: a careless dog at 0.0 m/s" in harmless


def test_printed_command_repeats_the_failure(pytester: pytest.Pytester) -> None:
    project(pytester)
    first = run(pytester, *SEARCH)
    (line,) = [each for each in first.outlines if each.startswith(AGAIN[:50])]
    words = re.fullmatch(r"Repeat: pytest '(.+)' (--garl-repeat=\S+) (-o) (\S+)", line)
    assert words
    again = run(pytester, *words.groups())
    again.assert_outcomes(failed=1)
    assert f"{HIT}" in again.stdout.str()


def test_pasted_command_runs_nothing_that_a_name_holds(pytester: pytest.Pytester) -> None:
    name = "a-$(touch EXECUTED)"
    maps = pytester.path / "scenarios" / "maps"
    maps.mkdir(parents=True)
    shutil.copy(Path(map_module.__file__).with_name("lawn.toml"), maps / f"{name}.toml")
    project(pytester, maps=f"[{name!r}]")
    output = run(pytester, *SEARCH).stdout.str()
    line = next(each for each in output.splitlines() if each.startswith("Repeat: "))
    shell = subprocess.run(
        ["bash", "-c", line.replace("Repeat: pytest", "printf '%s '")],
        cwd=pytester.path,
        check=True,
        capture_output=True,
        text=True,
    )
    assert f"--garl-repeat={name}-g00-s" in shell.stdout
    assert not (pytester.path / "EXECUTED").exists()


def test_verbose_report_shows_the_scenario_in_physical_units(pytester: pytest.Pytester) -> None:
    project(pytester)
    quiet = run(pytester, *SEARCH).stdout.str()
    assert "Scenario (seed" not in quiet
    assert "environment." not in quiet
    output = run(pytester, *SEARCH, "-v").stdout.str().replace("\n  ", " ")
    assert re.search(
        r"Scenario \(seed \d+\): dust, visibility \d+ m; fog, visibility [\d.]+ m;", output
    )
    assert re.search(r"falling rain, [\d.]+ mm/h", output)
    assert re.search(r"dog-1 a dog of up to [\d.]+ m/s, from \(-?[\d.]+, -?[\d.]+\) m", output)
    assert "environment." not in output
