"""A search flies the probes of its landing system before the first slot."""

from __future__ import annotations

import dataclasses
import os
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.plugin.session import probe_items
from pytest_garl.plugin.session.probe_items import (
    PASSED,
    excusing_case,
    has_cause_of,
    passed_before,
)
from pytest_garl.scenarios.files import load
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.task import Task
from pytest_garl.search.probes import GONE_S, clear_scenario
from tests.cases.samples import case
from tests.search.test_probes import FIELD
from tests.support import probed_landers
from tests.support.landing_project import project, result_hash

TESTS = """
import pytest
from pytest_garl import Start
from landers import {system}
HOVER = Start(mode="hover", height_m=6.0)
pytestmark = pytest.mark.garl(system={system}, maps=["lawn"], start=HOVER, domain="gone.toml")

def test_distance(landing):
    assert landing.distance_to_landing_m <= 10

def test_time(landing):
    assert landing.time_to_landing_s <= 120
"""
DOMAIN = """
npc_behaviour = "absent"
[told]
surveyed = [1, 1]
error_m = [0, 4]
towards_deg = [265, 275]
[cover]
from_s = [0, 1]
lasts_s = [0, 0.1]
share_percent = [0, 100]
"""
"""Both landers land in all of it."""
ONE_PROBE = """
from pytest_garl.search import probes
made = probes.probes_for

def pytest_runtest_setup(item):
    assert "database" not in item.fixturenames

def no_marker(*args):
    return [each for each in made(*args) if each.name == "no-marker"]

probes.probes_for = no_marker
"""
SEARCH = ("--garl-budget=1", "--garl-method=random", "--garl-workers=0")
ITEM = "test_it.py::probes[{}]"


def write(pytester: pytest.Pytester, system: str) -> None:
    """Write a project whose landing system flies two probes: beside the marker, and without."""
    shutil.copy(Path(probed_landers.__file__), pytester.path / "landers.py")
    (pytester.path / "conftest.py").write_text(ONE_PROBE)
    (pytester.path / "gone.toml").write_text(DOMAIN)
    (pytester.path / "test_it.py").write_text(TESTS.format(system=system))


def run(pytester: pytest.Pytester, probes: str, *more: str) -> pytest.RunResult:
    given = ("-p", "no:cacheprovider", "-o", f"garl_probes={probes}", *SEARCH, *more)
    return pytester.runpytest_subprocess(*given)


def collected(pytester: pytest.Pytester, probes: str) -> list[str]:
    done = run(pytester, probes, "--collect-only", "-q")
    return [line for line in done.outlines if "::" in line]


@pytest.mark.sim
def test_a_violated_probe_is_red_again(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = pytester.path / "step.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(step))
    write(pytester, "ZeroByDefault")
    done = run(pytester, "first", "--garl-shrink=0")
    done.assert_outcomes(failed=1, passed=2)
    assert done.ret == pytest.ExitCode.TESTS_FAILED
    done.stdout.fnmatch_lines(
        [
            "ZeroByDefault violates 1 of 2 probes on lawn:",
            "start-beside: ok: the marker lies 4 m * of the start: landed after *",
            "no-marker: FAILED: no marker is there for a minute: landed 4.0 m off *",
            "fly it: pytest test_it.py --garl-repeat=.garl/probes/lawn-no-marker.toml",
        ]
    )
    file = ".garl/probes/lawn-no-marker.toml"
    repeated = pytester.runpytest_subprocess(f"--garl-repeat={file}", "--garl-workers=0")
    repeated.assert_outcomes(passed=2)
    repeated.stdout.fnmatch_lines([f"garl: repeating {file}"])
    as_saved = load(pytester.path / file)
    assert as_saved["cover.lasts_s"] == GONE_S
    assert "\nProbe: ZeroByDefault on lawn: no-marker: FAILED: " in step.read_text()
    assert collected(pytester, "first")[0] == ITEM.format("ZeroByDefault")


@pytest.mark.sim
@pytest.mark.long
def test_a_violated_probe_is_shrunk_and_saved_and_its_known_case_excuses_it(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CI", raising=False)
    write(pytester, "ZeroByDefault")
    done = run(pytester, "first")
    done.stdout.fnmatch_lines(["saved scenarios/regressions/landers/lawn-I-*.toml"])
    (case,) = (pytester.path / "scenarios").rglob("lawn-I-*.toml")
    assert "cover (lasts 60 s, share 100 %)" in case.read_text()
    pytester.run(str(Path(sys.executable).with_name("garl")), "cases", "accept", str(case))
    again = run(pytester, "first", "--garl-shrink=0", "-v")
    again.stdout.fnmatch_lines([f"{ITEM.format('ZeroByDefault').replace('[', '[[]')} PASSED*"])
    assert again.ret == pytest.ExitCode.OK


@pytest.mark.sim
def test_probes_that_passed_are_flown_again_only_if_the_system_changes(
    pytester: pytest.Pytester,
) -> None:
    write(pytester, "Lander")
    run(pytester, "first", "--garl-shrink=0").assert_outcomes(passed=3)
    with_probes = result_hash(pytester)
    assert (pytester.path / ".garl" / PASSED).is_file()
    item = ITEM.format("Lander")
    assert item not in collected(pytester, "first")
    assert collected(pytester, "always")[0] == item
    assert item not in collected(pytester, "never")
    with (pytester.path / "landers.py").open("a") as file:
        file.write("CHANGED = True\n")
    assert collected(pytester, "first")[0] == item
    # Neither budget nor hash of the search knows of the probes.
    run(pytester, "never", "--garl-shrink=0").assert_outcomes(passed=2)
    assert result_hash(pytester) == with_probes


def test_an_unknown_value_is_a_usage_error(pytester: pytest.Pytester) -> None:
    write(pytester, "Lander")
    done = run(pytester, "sometimes")
    assert done.ret == pytest.ExitCode.USAGE_ERROR
    done.stderr.fnmatch_lines(["*garl_probes: found 'sometimes', expected first, always or never"])


def test_a_simulator_of_the_users_own_flies_no_probes(pytester: pytest.Pytester) -> None:
    project(pytester)
    assert collected(pytester, "always") == [
        f"test_it.py::test_{name}[lawn-g00-s00]" for name in ("distance", "time", "collisions")
    ]


def test_a_known_case_excuses_only_the_probe_with_its_cause() -> None:
    lawn = load_map("lawn")
    clear = clear_scenario(lawn, Task(), FIELD)
    twin = clear.replace({"told.error_m": 4.0})
    cover = {"cover.lasts_s": 60.0, "cover.share_percent": 100.0}
    probe = twin.replace(cover)
    assert has_cause_of(clear.replace(cover), probe, twin)
    assert has_cause_of(probe, probe, twin)
    assert not has_cause_of(twin, probe, twin)
    assert not has_cause_of(probe.replace({"wind.mean_mps": 5.0}), probe, twin)
    assert has_cause_of(twin, twin, twin)


def test_all_processes_of_a_session_agree_on_what_had_passed(tmp_path: Path) -> None:
    ledger = Ledger.create(tmp_path / "ledger.sqlite", {})
    try:
        (tmp_path / PASSED).write_text('["one"]')
        assert passed_before(ledger, tmp_path) == ["one"]
        # A worker of xdist that replaces another one collects after the first probes have passed.
        (tmp_path / PASSED).write_text('["one", "two"]')
        assert passed_before(ledger, tmp_path) == ["one"]
        assert passed_before(None, tmp_path) == ["one", "two"]
    finally:
        ledger.close()


def test_what_passes_in_two_processes_is_noted_by_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(probe_items, "_key", lambda options, target: target)
    options: Any = SimpleNamespace(folder=tmp_path)
    child = os.fork()
    names: list[Any] = [f"{'parent' if child else 'child'} {number}" for number in range(15)]
    try:
        for name in names:
            probe_items._note_passed(options, name)
    finally:
        if not child:
            os._exit(0)
    os.waitpid(child, 0)
    assert len(passed_before(None, tmp_path)) == 30


@pytest.mark.parametrize(("reason", "file"), [("", "saved.toml"), ("edge", "")])
def test_a_case_on_an_edge_excuses_no_probe(reason: Any, file: str) -> None:
    twin = clear_scenario(load_map("lawn"), Task(), FIELD)
    probe = twin.replace({"cover.lasts_s": 60.0, "cover.share_percent": 100.0})
    saved = dataclasses.replace(case(), scenario=probe, reason=reason, status="open")
    entry = SimpleNamespace(case=saved, path=Path("saved.toml"))
    corpus: Any = SimpleNamespace(entries=lambda name: [entry], is_accepted=lambda entry: True)
    assert excusing_case(corpus, saved.system, saved.ending, probe, twin) == file
