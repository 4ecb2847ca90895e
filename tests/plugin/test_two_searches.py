"""Two searches of one landing system on one map: each has its own table, page and command."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.reports.run_reading import read_run
from pytest_garl.reports.run_record import RunRecord
from pytest_garl.scenarios.files import parse_scenario
from tests.cli.test_report_command import garl
from tests.support.landing_project import project, run

TESTS = """
import pytest
from systems import Good
pytestmark = pytest.mark.garl(system=Good, maps=["lawn"], {limits})

def test_collisions(landing):
    assert not landing.collisions

def test_own(landing):
    assert landing.elapsed_s < 14.0, "too slow in {name}"
"""
SEED = """
import pytest
from systems import Good

@pytest.mark.garl(system=Good, maps=["lawn"], domain="{domain}")
def test_seed(landing, scenario):
    print("seed", scenario.seed)
"""
CALM, PAPER = "Good on lawn (domain calm)", "Good on lawn (domain paper)"


def two_files(pytester: pytest.Pytester, *limits: str) -> None:
    """Write two files of tests that fly one system on one map."""
    project(pytester)
    (pytester.path / "test_it.py").unlink()
    for name, text in zip(("first", "second"), limits, strict=True):
        (pytester.path / f"test_{name}.py").write_text(TESTS.format(limits=text, name=name))


def record(folder: Path) -> RunRecord:
    return read_run(folder / ".garl" / "ledger.sqlite", Corpus(folder))


def test_each_domain_has_a_table_of_its_own(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = pytester.path / "step.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(step))
    two_files(pytester, "domain='calm'", "domain='paper'")
    told = run(pytester, "--garl-budget=8", "--garl-workers=0", "--garl-report=pages")
    told.stdout.fnmatch_lines([f"{CALM}: 8 flown, *", f"{PAPER}: 8 flown, *"])
    assert f"({PAPER}, lawn-g00-" in " ".join(told.stdout.str().split()), "news of a kind"
    repeats = re.findall(r"  pytest (.*) --garl-repeat", told.stdout.str())
    assert {*repeats} == {"test_first.py", "test_second.py"}
    calm, paper = record(pytester.path).searches
    assert (calm.name, paper.name) == (CALM, PAPER)
    assert (calm.flown, paper.flown, calm.wanted, paper.wanted) == (8, 8, 8, 8)
    assert {calm.key.files, paper.key.files} == {("test_first.py",), ("test_second.py",)}
    (own,) = [kind for kind in calm.kinds if kind.type == "own"]
    assert (own.count, own.story) == (8, "too slow in first")
    assert "Good on lawn (domain calm)" in step.read_text()
    index = (pytester.path / "pages" / "index.html").read_text()
    kinds = {file.name for file in (pytester.path / "pages" / "kinds").iterdir()}
    assert len(kinds) == len(calm.kinds) + len(paper.kinds)
    assert all(f"kinds/{name}" in index for name in kinds)


def test_the_report_tells_searches_of_one_place_apart(pytester: pytest.Pytester) -> None:
    two_files(pytester, "domain='calm'", "domain='paper'")
    run(pytester, "--garl-budget=4", "--garl-workers=0")
    ledger = ".garl/ledger.sqlite"
    found = json.loads(garl(pytester.path, "report", "--json"))
    assert [(each["name"], each["domain"]) for each in found["searches"]] == [
        (CALM, "calm"),
        (PAPER, "paper"),
    ]
    assert found["searches"][0]["tests"] == [
        "test_first.py::test_collisions",
        "test_first.py::test_own",
    ]
    assert f"{CALM}: 4 of 4 flown" in garl(pytester.path, "report")
    compared = garl(pytester.path, "report", ledger, ledger)
    assert f"\n{CALM}\n" in compared
    assert f"\n{PAPER}\n" in compared


def test_other_limits_are_another_search_by_its_file(pytester: pytest.Pytester) -> None:
    two_files(pytester, "", "limits=__import__('pytest_garl').limits(distance_m=2.0)")
    run(pytester, "--garl-budget=4", "--garl-workers=0")
    found = record(pytester.path).searches
    assert [each.name for each in found] == [
        "Good on lawn (test_first.py)",
        "Good on lawn (test_second.py)",
    ]
    assert [len(each.limits) for each in found] == [1, 1]


def test_files_that_share_the_flights_are_one_search(pytester: pytest.Pytester) -> None:
    two_files(pytester, "", "")
    run(pytester, "--garl-budget=4", "--garl-workers=0")
    (one,) = record(pytester.path).searches
    assert (one.name, one.flown) == ("Good on lawn", 4)
    assert one.key.files == ("test_first.py", "test_second.py")


def test_a_repeated_slot_has_the_scenario_of_its_own_search(pytester: pytest.Pytester) -> None:
    project(pytester)
    files = {"test_it.py": "calm", "test_second.py": "paper"}
    for file, domain in files.items():
        (pytester.path / file).write_text(SEED.format(domain=domain))
    run(pytester, "--garl-budget=2", "--garl-workers=0")
    seeds = {
        each.key.domain: parse_scenario(each.by_slot["lawn-g00-s01"].scenario).seed
        for each in record(pytester.path).searches
    }
    assert seeds["calm"] != seeds["paper"]
    for file, domain in files.items():
        told = run(pytester, "-rA", file, "--garl-repeat=lawn-g00-s01", "--garl-workers=0")
        told.stdout.fnmatch_lines([f"seed {seeds[domain]}"])
