from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from pytest_garl.cli import main
from tests.plugin.test_plugin import write_project

GATE = ("--garl-baseline=base.toml", "--garl-workers=0")
BETTER = ("> 0.7 and", "> 7 and")
WORSE = ("> 0.7 and", "> 0.3 and")
OTHER = ('kind="dog"', 'kind="cat"')


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *(args or GATE))


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project with the baseline of what a random search flew."""
    folder = tmp_path_factory.mktemp("saved")
    write_project(folder)
    search = ("--garl-budget=40", "--garl-method=random", "--garl-workers=0", "--garl-shrink=0")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *search]
    subprocess.run(command, cwd=folder, capture_output=True, check=False)
    ledger, out = folder / ".garl" / "ledger.sqlite", folder / "base.toml"
    done = CliRunner().invoke(
        main, ["baseline", "save", "--from-ledger", str(ledger), "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    assert "Good-lawn: 40 flown, " in done.output
    shutil.rmtree(folder / ".garl")
    return folder


@pytest.fixture
def saved(pytester: pytest.Pytester, template: Path) -> pytest.Pytester:
    """Return a copy of that project."""
    shutil.copytree(template, pytester.path, dirs_exist_ok=True)
    return pytester


def test_an_unchanged_stack_passes_with_the_same_flights(saved: pytest.Pytester) -> None:
    result = run(saved)
    result.assert_outcomes(passed=1, skipped=3)
    result.stdout.fnmatch_lines(
        [
            "garl: gate against base.toml: 40 of Good-lawn, level 0.05",
            "Good-lawn: gate passed",
            "*40 pairs flown, 40 of them the same flight to the byte, 0 inconclusive*",
            "*violations * -> * (0 more, 0 fewer): p 1.000, for both tests 1.000, level 0.05",
            "*aborts 0 -> 0 (0 more, 0 fewer): p 1.000*",
        ]
    )
    assert result.ret == pytest.ExitCode.OK
    assert not list((saved.path / ".garl").glob("cases-*"))


@pytest.mark.parametrize("how", [("--garl-workers=0",), ("--garl-workers=2", "-n2")])
def test_a_worse_stack_fails_and_its_broken_pairs_are_listed(
    saved: pytest.Pytester, how: tuple[str, ...]
) -> None:
    change(saved.path / "tiny_simulator.py", *WORSE)
    result = run(saved, "--garl-baseline=base.toml", *how)
    result.assert_outcomes(failed=1, skipped=3)
    result.stdout.fnmatch_lines(["*Good-lawn: gate FAILED: significantly more violations: p *"])
    result.stdout.fnmatch_lines(["    broke    lawn-*: landed -> IV:dog:*"])
    result.stdout.fnmatch_lines(
        ["    fly it: garl baseline scenario *base.toml lawn-* > one.toml; pytest --garl-repeat=*"]
    )
    result.stdout.fnmatch_lines(["FAILED test_it.py::baseline[[]Good-lawn[]]*"])
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_the_level_decides_and_a_better_stack_passes(saved: pytest.Pytester) -> None:
    change(saved.path / "tiny_simulator.py", *WORSE)
    lenient = run(saved, *GATE, "--garl-level=1e-9")
    lenient.assert_outcomes(passed=1, skipped=3)
    change(saved.path / "tiny_simulator.py", "> 0.3 and", "> 7 and")
    better = run(saved)
    better.assert_outcomes(passed=1, skipped=3)
    better.stdout.fnmatch_lines(["    mended   lawn-*: IV:dog:* -> landed"])


def test_a_new_kind_of_violation_fails_at_an_equal_rate(
    saved: pytest.Pytester,
) -> None:
    change(saved.path / "tiny_simulator.py", *OTHER)
    result = run(saved)
    result.assert_outcomes(failed=1, skipped=3)
    result.stdout.fnmatch_lines(["*gate FAILED: new signature: IV:cat:*", "*(0 more, 0 fewer)*"])
    result.stdout.fnmatch_lines(["    changed  lawn-*: IV:dog:* -> IV:cat:*"])


def test_another_world_is_no_fair_comparison(saved: pytest.Pytester) -> None:
    change(saved.path / "base.toml", "time_s = 120.0", "time_s = 60.0")
    result = run(saved)
    result.assert_outcomes(failed=1, skipped=3)
    result.stdout.fnmatch_lines(
        ["*gate FAILED: no fair comparison, limits: saved with *, 60 s, *, found *, 120 s, *"]
    )


def test_a_gate_is_selected_like_any_test_and_one_without_subject_is_an_error(
    saved: pytest.Pytester,
) -> None:
    result = run(saved, *GATE, "test_it.py::baseline[Good-lawn]")
    result.assert_outcomes(passed=1)
    nothing = run(saved, *GATE, "-k", "test_time")
    assert nothing.ret == pytest.ExitCode.USAGE_ERROR
    nothing.stderr.fnmatch_lines(["*nothing to compare: it holds systems:Good on lawn, and no *"])
    parallel = run(saved, *GATE, "-k", "test_time", "-n1")
    assert parallel.ret == pytest.ExitCode.USAGE_ERROR
    parallel.stdout.fnmatch_lines(["*nothing to compare: *"])
    by_ini = run(saved, "--garl-workers=0", "-o", "garl_baseline=base.toml", "-k", "test_time")
    assert by_ini.ret == pytest.ExitCode.OK


def test_a_broken_baseline_is_one_clear_error(saved: pytest.Pytester) -> None:
    change(saved.path / "base.toml", "schema = 1", "schema = 9")
    result = run(saved)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--garl-baseline: *base.toml: key 'schema': found 9, expected 1"])
    missing = run(saved, "--garl-baseline=no.toml")
    missing.stderr.fnmatch_lines(["*--garl-baseline: found 'no.toml', expected a file that `garl*"])


def test_a_gate_beside_a_search_touches_none_of_its_figures(saved: pytest.Pytester) -> None:
    search = ("--garl-budget=8", "--garl-shrink=0", "--garl-duplicates=fail")
    result = run(saved, *GATE, *search)
    result.stdout.fnmatch_lines(["*Good on lawn: 8 flown, *"])
    result.stdout.fnmatch_lines(["Good-lawn: gate passed"])
