from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from pytest_garl.cli import main
from tests.support.case_project import (
    CASES,
    SEARCH,
    cases,
    let_system_avoid_dog,
    replace_text,
    run,
    violations,
)
from tests.support.landing_project import project

EDGE = 'gates = false\nreason = "edge"'


@pytest.mark.parametrize("folder", ["below", ".."])
def test_commands_work_where_pytest_was_called(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    """People call pytest in a folder below its root, or above it."""
    project(pytester)
    (pytester.path / "below").mkdir()
    here = pytester.path / folder
    monkeypatch.chdir(here)
    path = os.path.relpath(pytester.path / "test_it.py", here.resolve())
    search = ("--garl-budget=3", "--garl-workers=0", "--garl-shrink=0")
    result = run(pytester, path, *search)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    repeat = f"Repeat: pytest '{path}::test_distance[[]lawn-g00-s00]' --garl-repeat=lawn-g00-s00"
    result.stdout.fnmatch_lines([repeat])
    again = (f"{path}::test_distance[lawn-g00-s00]", "--garl-repeat=lawn-g00-s00")
    run(pytester, *again, "--garl-workers=0").assert_outcomes(failed=1)


def test_cases_fly_under_xdist(searched: pytest.Pytester) -> None:
    run(searched, "-n2", "--garl-workers=1").assert_outcomes(passed=2, skipped=2, xfailed=2)
    assert not list((searched.path / ".garl").glob("cases-*"))


def test_open_case_that_passes_on_a_changed_simulator_is_stale(
    searched: pytest.Pytester,
) -> None:
    replace_text(searched.path / "tiny_simulator.py", "> 0.7 and", "> 7 and")
    result = run(searched)
    result.assert_outcomes(passed=5, xfailed=1)
    result.stdout.fnmatch_lines(["stale: *IV-dog*.toml passes, but the simulator has changed"])
    result.stdout.no_fnmatch_line("maybe fixed*")


def test_open_case_that_passes_may_be_fixed(searched: pytest.Pytester) -> None:
    let_system_avoid_dog(searched.path)
    result = run(searched)
    result.assert_outcomes(passed=5, xfailed=1)
    result.stdout.fnmatch_lines(
        [
            "maybe fixed: scenarios/*IV-dog*.toml passes; if it is fixed:",
            "    garl cases promote scenarios/*IV-dog*.toml",
        ]
    )
    assert result.ret == 0
    strict = run(searched, *CASES, "-o", "garl_xfail_strict=true")
    assert strict.ret == pytest.ExitCode.TESTS_FAILED
    strict.stdout.fnmatch_lines(["*is open but passes (garl_xfail_strict)*"])


@pytest.mark.parametrize("status", ["open", "fixed"])
@pytest.mark.parametrize("repaired", [False, True])
def test_edge_case_fails_no_run(searched: pytest.Pytester, status: str, repaired: bool) -> None:
    dog = cases(searched)[1]
    replace_text(dog, 'status = "open"', f'status = "{status}"\n{EDGE}')
    if repaired:
        let_system_avoid_dog(searched.path)
    result = run(searched, "--garl-workers=0", "-rx", "-o", "garl_xfail_strict=true", "-kIV")
    ends = "passes" if repaired else "fails"
    result.stdout.fnmatch_lines([f"*case-lawn-IV-dog*edge: {ends}; IV:dog:*"])
    assert result.ret == 0
    result.stdout.no_fnmatch_line("maybe fixed*")


def test_edge_case_hides_no_mistake_in_a_test(searched: pytest.Pytester) -> None:
    replace_text(cases(searched)[1], 'status = "open"', f'status = "open"\n{EDGE}')
    replace_text(searched.path / "test_it.py", "not landing.collisions", "not landing.colisions")
    result = run(searched, "--garl-workers=0", "-kIV")
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def let_system_give_up(project: Path) -> None:
    """Let the UAV give up where a dog has hit it."""
    replace_text(project / "tiny_simulator.py", 'outcome = "collision"', 'outcome = "gave_up"')


def test_open_case_that_gives_up_needlessly_fails_in_another_way(
    searched: pytest.Pytester,
) -> None:
    let_system_give_up(searched.path)
    result = run(searched, "-kIV")
    result.stdout.fnmatch_lines(["*IV-dog*fails in another way.", "Saved: IV:dog:*", "Flown: II:*"])
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_open_case_that_gives_up_as_its_limits_allow_counts_as_passed(
    searched: pytest.Pytester,
) -> None:
    let_system_give_up(searched.path)
    allowed = "system=Good, limits={'abort': 'ok'}, "
    replace_text(searched.path / "test_it.py", "system=Good, ", allowed)
    result = run(searched)
    result.assert_outcomes(passed=3, skipped=2, xfailed=1)
    result.stdout.fnmatch_lines(["stale: scenarios/*IV-dog*.toml passes, but the simulator*"])
    strict = run(searched, *CASES, "-o", "garl_xfail_strict=true")
    strict.assert_outcomes(passed=2, skipped=2, xfailed=1, failed=1)
    assert strict.ret == pytest.ExitCode.TESTS_FAILED


def test_case_hides_no_other_property(searched: pytest.Pytester) -> None:
    tests = searched.path / "test_it.py"
    own = "\ndef test_own(landing):\n    assert landing.flight.elapsed_s < 14\n"
    tests.write_text(tests.read_text() + own + "\ndef test_typo(landing):\n    landing.hits\n")
    result = run(searched)
    # Both fail in each of the two cases, whose own failures stay expected.
    result.assert_outcomes(passed=2, skipped=2, xfailed=2, failed=4)
    again = run(searched, *SEARCH)
    kinds = [line for line in again.outlines if line.startswith("FAILED")]
    assert sum("test_own[lawn" in line for line in kinds) == 1
    assert sum("test_typo[lawn" in line for line in kinds) == 24


def test_open_case_that_fails_in_another_way_fails_the_run(searched: pytest.Pytester) -> None:
    replace_text(searched.path / "tiny_simulator.py", 'body="dog-1"', 'body="tree-1"')
    replace_text(searched.path / "tiny_simulator.py", 'kind="dog"', 'kind="tree"')
    replace_text(searched.path / "tiny_simulator.py", '"dynamic"', '"static"')
    result = run(searched)
    result.stdout.fnmatch_lines(
        ["*IV-dog*fails in another way.", "Saved: IV:dog:*", "Flown: III:tree:*", "See it: garl*"]
    )
    result.stdout.fnmatch_lines(["If it is no worse*: garl cases shrink --as-it-fails *IV-dog*"])
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_fixed_case_must_pass_with_its_moves_and_with_a_live_policy(
    searched: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = searched.path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    replace_text(cases(searched)[1], 'status = "open"', 'status = "fixed"\nlive = true')
    broken = run(searched)
    broken.assert_outcomes(passed=2, skipped=4, xfailed=1, failed=2)
    broken.stdout.fnmatch_lines(["*case-lawn-IV-dog-*-live*", "*was fixed and fails again.*"])
    rows = [line for line in page.read_text().splitlines() if "case-lawn-IV-dog-" in line]
    assert any(" | a hostile dog at 0.0 m/s for 14.2 s | `garl cases " in row for row in rows), rows
    replace_text(searched.path / "tiny_simulator.py", "> 0.7 and", "> 7 and")
    run(searched).assert_outcomes(passed=8, xfailed=1)


LOSES_ITS_LEDGER = """

import pathlib
import sqlite3
import pytest

@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session):
    with sqlite3.connect(pathlib.Path(session.config.rootpath, ".garl", "ledger.sqlite")) as db:
        db.execute("DROP TABLE slot")
"""


def test_step_summary_names_failed_cases_though_the_ledger_is_lost(
    searched: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = searched.path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    replace_text(cases(searched)[1], 'status = "open"', 'status = "fixed"')
    conftest = searched.path / "conftest.py"
    conftest.write_text(conftest.read_text() + LOSES_ITS_LEDGER)
    result = run(searched, *SEARCH)
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
    assert "| case-lawn-IV-dog-" in page.read_text()


@pytest.mark.parametrize("reason", ["sensor-limited", "unpreventable"])
def test_case_that_was_not_preventable_excuses_itself_alone(
    searched: pytest.Pytester, reason: str
) -> None:
    (dog,) = [path for path in cases(searched) if "-IV-dog-" in path.name]
    replace_text(dog, 'status = "open"', f'status = "open"\ngates = false\nreason = "{reason}"')
    result = run(searched, "-rx", "-kIV")
    result.stdout.fnmatch_lines([f"*case-lawn-IV-dog*{reason}: IV:dog:*"])
    assert result.ret == 0
    again = run(searched, *SEARCH, "--garl-shrink=0", "--garl-seed=1")
    assert again.parseoutcomes()["failed"] == 1
    again.stdout.fnmatch_lines(["FAILED *test_collisions*"])
    assert again.ret == pytest.ExitCode.TESTS_FAILED


def test_case_is_expected_once_it_is_committed_or_accepted(
    searched: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.rmtree(searched.path / ".git")
    monkeypatch.setenv("COLUMNS", "200")
    files = [str(path) for path in cases(searched)]
    for _ in range(2):
        result = run(searched, *CASES)
        result.assert_outcomes(passed=2, skipped=2, failed=2)
        result.stdout.fnmatch_lines(
            [
                "garl: cannot tell which cases are committed (*not a git repository*",
                "If that is known: commit it, or: garl cases accept *IV-dog*.toml",
            ]
        )
        result.stdout.fnmatch_lines(
            ["FAILED *IV-dog* - collided with dog-1 at *; this case is new and not accepted yet"]
        )
        # A search says the same, however often.
        assert run(searched, *SEARCH).parseoutcomes()["failed"] == 4
    assert CliRunner().invoke(main, ["cases", "accept", *files]).exit_code == 0
    run(searched).assert_outcomes(passed=2, skipped=2, xfailed=2)
    assert run(searched, *SEARCH).ret == 0


def test_repeat_shows_the_failure_of_an_expected_case(searched: pytest.Pytester) -> None:
    run(searched, *SEARCH)
    slot = next(
        f"lawn-g{generation:02d}-s{slot:02d}"
        for generation, slot, signature in violations(searched)
        if signature.startswith("IV:dog")
    )
    result = run(searched, "--garl-workers=0", f"--garl-repeat={slot}")
    result.assert_outcomes(failed=1, skipped=2)
    result.stdout.fnmatch_lines(["*Collided with dog-1*"])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('status = "open"', "status = open", "not valid TOML"),
        ("schema = 2", "schema = 9", "key 'schema': found 9, expected 2"),
        (
            "[scenario.marker]",
            "[scenario.weather]\nfog_visibility_m = 1.5\n\n[scenario.marker]",
            "'scenario.weather.fog_visibility_m': found 1.5",
        ),
        ('map = "lawn"', 'map = "moon"', "key 'map': unknown map 'moon'"),
        ("dog-1 = []", "dog-1 = [[1, 2.0, 0.0]]", "'moves.dog-1': found [[]1, 2.0, 0.0]"),
        ("dog-1 = []", "cat-1 = []", "'moves.cat-1': unknown key"),
    ],
)
def test_broken_case_fails_alone_and_names_file_and_key(
    searched: pytest.Pytester, old: str, new: str, words: str
) -> None:
    path = cases(searched)[1]
    replace_text(path, old, new)
    result = run(searched)
    result.assert_outcomes(passed=2, xfailed=1, errors=3)
    result.stdout.fnmatch_lines([f"*{path.name}*{words}*"])
