from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from tests.support.landing_project import (
    project,
    result_hash,
    run,
)

SAVED = Path(__file__).parents[3] / "docs" / "tutorial" / "scenarios"


def test_a_session_without_budget_skips_its_tests_and_says_why(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "-rs")
    result.assert_outcomes(skipped=3)
    result.stdout.fnmatch_lines(["*no --garl-budget given*"])


def test_collect_only_flies_nothing(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=40", "--collect-only", "-q")
    result.stdout.fnmatch_lines(["test_it.py::test_distance[[]lawn-g00-s00[]]"])
    assert not (pytester.path / ".garl").exists()


def test_a_selected_slot_flies_alone(pytester: pytest.Pytester) -> None:
    project(pytester)
    selected = ("--garl-budget=40", "--garl-workers=0", "-k", "lawn-g02-s03")
    result = run(pytester, *selected, "--garl-method=random")
    result.stdout.fnmatch_lines(["*lawn: 1 flown*"])
    # A bred slot needs its parents: two generations of eight.
    result = run(pytester, *selected, "--garl-method=garl-paper")
    result.stdout.fnmatch_lines(["*lawn: 17 flown*"])


def test_a_repeated_slot_comes_from_the_ledger_and_leaves_it_unchanged(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    run(pytester, "--garl-budget=16", "--garl-workers=0")
    before = result_hash(pytester)
    result = run(pytester, "--garl-workers=0", "--garl-repeat=lawn-g01-s05")
    result.stdout.fnmatch_lines(["*1 flown*"])
    assert result_hash(pytester) == before


@pytest.mark.parametrize(("args", "policy"), [((), "stand"), (("--garl-npcs=greedy",), "greedy")])
def test_a_repeated_slot_has_the_npc_policy_of_its_search_unless_an_option_names_one(
    pytester: pytest.Pytester, args: tuple[str, ...], policy: str
) -> None:
    project(pytester)
    run(pytester, "--garl-budget=1", "--garl-workers=0", "--garl-npcs=stand")
    run(pytester, "--garl-workers=0", "--garl-repeat=lawn-g00-s00", *args)
    ledger = Ledger(pytester.path / ".garl" / "repeat.sqlite")
    [(_, job)] = ledger.searches()
    ledger.close()
    assert parse_job(job).npcs.name == policy


def test_a_repeated_slot_of_an_unreadable_ledger_is_one_usage_error(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    (pytester.path / ".garl").mkdir()
    (pytester.path / ".garl" / "ledger.sqlite").write_text("no ledger")
    result = run(pytester, "--garl-repeat=lawn-g00-s00")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--garl-repeat=lawn-g00-s00: *ledger.sqlite*"])


def test_repeating_a_saved_case_names_the_command_that_replays_it(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    case = next(SAVED.rglob("*.toml"))
    result = run(pytester, f"--garl-repeat={case}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    # One error, however many tests there are.
    assert result.stderr.str().count("found a saved case") == 1
    result.stderr.fnmatch_lines([f"*found a saved case*garl cases replay {case}*"])
