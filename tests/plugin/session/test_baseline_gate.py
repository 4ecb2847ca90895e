from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from pytest_garl.cli import main
from tests.support.landing_project import write_project

GATE = ("--garl-baseline=base.toml", "--garl-workers=0")
BETTER = ("> 0.7 and", "> 7 and")
WORSE = ("> 0.7 and", "> 0.3 and")
OTHER = ('kind="dog"', 'kind="cat"')
STATIC = ('body_class="dynamic"', 'body_class="static"')
CAUTIOUS = ('        outcome = "collision"', '        outcome = "gave_up"')


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *(args or GATE))


def change(path: Path, old: str, new: str, count: int = -1) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, count))


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
    assert "Good-lawn: 40 flown; " in done.output
    shutil.rmtree(folder / ".garl")
    return folder


@pytest.fixture
def saved(pytester: pytest.Pytester, template: Path) -> pytest.Pytester:
    """Return a copy of that project."""
    shutil.copytree(template, pytester.path, dirs_exist_ok=True)
    return pytester


def test_a_hook_may_ask_the_gate_for_its_fixtures(saved: pytest.Pytester) -> None:
    with (saved.path / "conftest.py").open("a") as conftest:
        conftest.write(
            "\ndef pytest_collection_modifyitems(items):\n"
            "    assert not [item for item in items if 'database' in item.fixturenames]\n"
        )
    result = run(saved, *GATE, "--collect-only", "-q")
    assert result.ret == pytest.ExitCode.OK
    result.stdout.fnmatch_lines(["*::baseline[[]Good-lawn]"])


def test_unchanged_system_passes_with_the_same_flights(saved: pytest.Pytester) -> None:
    result = run(saved)
    result.assert_outcomes(passed=1, skipped=3)
    assert "nothing was flown" not in result.stdout.str()
    result.stdout.fnmatch_lines(
        [
            "garl: gate against base.toml: 40 of Good-lawn, level 0.05",
            "Good-lawn: gate passed",
            "*40 pairs compared, 40 of them the same flight to the byte",
            "            landed      violations  blocked     excused     needless",
            "    before  21 (52 %)   19          0           0           0",
            "    after   21 (52 %)   19          0           0           0",
            "    violations 19 -> 19 (0 broke, 0 fixed): too few pairs differ to fail",
            "    safe aborts 0 -> 0 (0 landings lost, 0 landings won): too few pairs differ *",
            "    distance of 21 pairs that landed: median * m, worst * m: too few pairs differ *",
            "    time of 21 pairs that landed: median * s, worst * s: too few pairs differ *",
        ]
    )
    assert result.ret == pytest.ExitCode.OK
    assert not list((saved.path / ".garl").glob("cases-*"))


@pytest.mark.parametrize("how", [("--garl-workers=0",), ("--garl-workers=2", "-n2")])
def test_worse_system_fails_and_summary_lists_its_broken_pairs(
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


def test_a_mark_of_the_module_hides_no_failed_gate_from_a_build_server(
    saved: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    change(saved.path / "tiny_simulator.py", *WORSE)
    with (saved.path / "test_it.py").open("a") as tests:
        tests.write("\npytestmark = [pytestmark, pytest.mark.xfail(reason='later')]\n")
    monkeypatch.setenv("CI", "true")
    result = run(saved)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["1 failure hidden by a mark xfail or by a hook:*"])


@pytest.mark.parametrize("workers", [(), ("-n1",)])
def test_a_gate_that_a_mark_skips_is_no_success(
    saved: pytest.Pytester, workers: tuple[str, ...]
) -> None:
    with (saved.path / "test_it.py").open("a") as tests:
        tests.write("\npytestmark = [pytestmark, pytest.mark.skip(reason='later')]\n")
    result = run(saved, *GATE, *workers)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    output = " ".join(result.stdout.str().split())
    assert "nothing was compared: test_it.py::baseline[Good-lawn] was skipped" in output
    assert run(saved, *GATE, "--collect-only").ret == pytest.ExitCode.OK


def test_a_class_may_carry_the_marker_of_a_gate(saved: pytest.Pytester) -> None:
    saved.makepyfile(
        test_it="import pytest\nfrom systems import *\n"
        "@pytest.mark.garl(system=Good, maps=['lawn'])\n"
        "class TestGood:\n    def test_a(self, landing): pass\n"
    )
    assert run(saved).ret == pytest.ExitCode.OK
    change(saved.path / "tiny_simulator.py", *WORSE)
    result = run(saved)
    result.assert_outcomes(failed=1, skipped=1)
    result.stdout.fnmatch_lines(["*TestGood::baseline[[]Good-lawn]*"])


def test_level_decides_and_better_system_passes(saved: pytest.Pytester) -> None:
    change(saved.path / "tiny_simulator.py", *WORSE)
    lenient = run(saved, *GATE, "-o", "garl_level=1e-9")
    lenient.assert_outcomes(passed=1, skipped=3)
    change(saved.path / "tiny_simulator.py", "> 0.3 and", "> 7 and")
    better = run(saved)
    better.assert_outcomes(passed=1, skipped=3)
    better.stdout.fnmatch_lines(["    fixed    lawn-*: IV:dog:* -> landed"])


def test_new_kind_of_a_known_type_passes_with_a_note(saved: pytest.Pytester) -> None:
    change(saved.path / "tiny_simulator.py", *OTHER)
    result = run(saved)
    result.assert_outcomes(passed=1, skipped=3)
    result.stdout.fnmatch_lines(["*new kind of a known type, not gated: IV:cat:* in lawn-*"])
    result.stdout.fnmatch_lines(["    changed  lawn-*: IV:dog:* -> IV:cat:*"])


def test_new_type_fails_at_an_equal_rate_if_its_neighbours_fail(
    saved: pytest.Pytester,
) -> None:
    change(saved.path / "tiny_simulator.py", *STATIC)
    result = run(saved)
    result.assert_outcomes(failed=1, skipped=3)
    result.stdout.fnmatch_lines(
        ["*gate FAILED: new type of violation: III in lawn-*, in * of 9 neighbours"]
    )
    result.stdout.fnmatch_lines(["*violations 19 -> 19 (0 broke, 0 fixed): *"])
    result.stdout.fnmatch_lines(["    changed  lawn-*: IV:dog:* -> III:dog:*"])


def test_collisions_that_became_aborts_pass(saved: pytest.Pytester) -> None:
    change(saved.path / "tiny_simulator.py", *CAUTIOUS)
    result = run(saved)
    result.assert_outcomes(passed=1, skipped=3)
    result.stdout.fnmatch_lines(
        ["*safe aborts 0 -> * (0 landings lost, 0 landings won): too few pairs *"]
    )
    result.stdout.fnmatch_lines(["    fixed    lawn-*: IV:dog:* -> II:*"])


def test_inconclusive_flight_fails_the_gate(saved: pytest.Pytester) -> None:
    change(saved.path / "base.toml", '"landed", ""', '"inconclusive", ""', count=1)
    result = run(saved)
    result.assert_outcomes(passed=1, skipped=3)
    result.stdout.fnmatch_lines(
        ["*39 pairs compared, 39 of*", "*1 left out: inconclusive when the *"]
    )
    change(saved.path / "base.toml", '"landed", ""', '"inconclusive", ""')
    result = run(saved)
    result.assert_outcomes(failed=1, skipped=3)
    result.stdout.fnmatch_lines(
        ["*gate FAILED: * of 40 flights of the baseline were inconclusive*"]
    )


def test_summary_warns_of_a_baseline_from_an_adaptive_search(saved: pytest.Pytester) -> None:
    change(saved.path / "base.toml", 'method = "random"', 'method = "garl"')
    result = run(saved)
    result.assert_outcomes(passed=1, skipped=3)
    result.stdout.fnmatch_lines(
        ["*note: the search method 'garl' chose *kinder to a change than *"]
    )


def test_gate_refuses_to_compare_other_limits(saved: pytest.Pytester) -> None:
    change(saved.path / "base.toml", "time_s = 120.0", "time_s = 60.0")
    result = run(saved)
    result.assert_outcomes(failed=1, skipped=3)
    result.stdout.fnmatch_lines(
        ["*gate FAILED: no fair comparison, limits: *, time 60 s, *, found *, time 120 s, *"]
    )


def test_gate_is_selected_like_any_test_and_fails_without_a_marked_test(
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


def test_broken_baseline_is_one_clear_error(saved: pytest.Pytester) -> None:
    change(saved.path / "base.toml", "schema = 2", "schema = 9")
    result = run(saved)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--garl-baseline: *base.toml: key 'schema': found 9, expected 2"])
    missing = run(saved, "--garl-baseline=no.toml")
    missing.stderr.fnmatch_lines(["*--garl-baseline: found 'no.toml', expected a file that `garl*"])


def test_gate_beside_a_search_changes_none_of_its_figures(saved: pytest.Pytester) -> None:
    search = ("--garl-budget=8", "--garl-shrink=0", "-o", "garl_duplicates=fail")
    result = run(saved, *GATE, *search)
    result.stdout.fnmatch_lines(["*Good on lawn: 8 flown, *"])
    result.stdout.fnmatch_lines(["Good-lawn: gate passed"])
