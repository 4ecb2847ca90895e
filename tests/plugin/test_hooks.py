from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.landing_project import (
    CONFTEST,
    SYSTEMS,
    TESTS,
    project,
    result_hash,
    run,
)


@pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
def test_each_violation_fails_one_item_and_xfails_its_duplicates(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=24", "--garl-workers=0", *parallel)
    outcomes = result.parseoutcomes()
    # Two mechanisms (a dog, and fog that misleads) fail once each.
    assert outcomes["failed"] == 2
    assert outcomes["xfailed"] >= 2
    assert outcomes["passed"] + outcomes["skipped"] + outcomes["xfailed"] + 2 == 72
    result.stdout.fnmatch_lines(
        ["*garl: what happened*", "*Collided with dog-1*", "*Repeat: pytest*"]
    )
    result.stdout.fnmatch_lines(["*Good on lawn: 24 flown*"])
    result.stdout.fnmatch_lines(["* IV:dog:* pytest test_it.py --garl-repeat=lawn-g*"])


IN_PYTEST, SPREAD = ("0",), ("2", "-n2", "--dist=worksteal")


@pytest.mark.parametrize(
    "ways",
    [(IN_PYTEST, SPREAD), pytest.param((IN_PYTEST, ("1",), ("4",)), marks=pytest.mark.long)],
    ids=["as xdist", "as more workers"],
)
def test_the_same_seed_gives_the_same_results_for_any_workers(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, ways: tuple[tuple[str, ...], ...]
) -> None:
    project(pytester)
    hashes = set()
    for args in ways:
        # Nor does the order of sets change them.
        monkeypatch.setenv("PYTHONHASHSEED", f"1{args[0]}")
        run(pytester, "--garl-budget=16", f"--garl-workers={args[0]}", *args[1:])
        hashes.add(result_hash(pytester))
    assert len(hashes) == 1
    monkeypatch.delenv("PYTHONHASHSEED")
    run(pytester, "--garl-budget=16", "--garl-workers=0", "--garl-seed=1")
    assert result_hash(pytester) not in hashes


@pytest.mark.long
def test_a_network_that_learns_in_pytest_finds_the_same_for_any_workers(
    pytester: pytest.Pytester,
) -> None:
    pytest.importorskip("torch")
    project(pytester)
    hashes = set()
    for args in (("--garl-workers=0",), ("--garl-workers=2", "-n2")):
        run(pytester, "--garl-budget=80", "--garl-method=offline-rl", "-k", "test_time", *args)
        hashes.add(result_hash(pytester))
    assert len(hashes) == 1


def test_duplicates_can_be_shown_as_failures(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=24", "--garl-workers=0", "-o", "garl_duplicates=fail")
    outcomes = result.parseoutcomes()
    assert outcomes["failed"] > 2
    assert "xfailed" not in outcomes


def test_the_lowest_slot_fails_whatever_the_order(pytester: pytest.Pytester) -> None:
    project(pytester)
    straight = run(pytester, "--garl-budget=24", "--garl-workers=0", "-rf")
    backwards = CONFTEST + "\ndef pytest_collection_modifyitems(items): items.reverse()\n"
    pytester.makeconftest(backwards)
    reverse = run(pytester, "--garl-budget=24", "--garl-workers=0", "-rf")

    def failed(result: pytest.RunResult) -> set[str]:
        return {line.split(" - ")[0] for line in result.outlines if line.startswith("FAILED")}

    assert failed(straight) == failed(reverse)
    assert len(failed(straight)) == 2


@pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
@pytest.mark.parametrize(
    ("system", "words", "share"),
    [
        ("Raises", "*ZeroDivisionError: no plan*", "Python error"),
        ("Exits", "*its process ended with exit status 3*", "died"),
        ("Sleeps", "*one call took longer than*", "hung"),
    ],
)
def test_a_broken_system_is_a_finding_and_the_run_goes_on(
    pytester: pytest.Pytester,
    system: str,
    words: str,
    share: str,
    parallel: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    project(pytester, system)
    # No line breaks in a share.
    monkeypatch.setenv("COLUMNS", "120")
    result = run(pytester, "--garl-budget=2", "--garl-workers=1", "--garl-timeout=0.3", *parallel)
    result.assert_outcomes(failed=1, skipped=4, xfailed=1)
    result.stdout.fnmatch_lines([words])
    result.stdout.fnmatch_lines(["*2 flown, landed 0 %, violations 100 %*", f"*{share} 100 %*"])


def test_x_stops_at_the_first_failure(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=24", "--garl-workers=0", "-x")
    assert result.parseoutcomes()["failed"] == 1


def test_junit_carries_the_signature(pytester: pytest.Pytester) -> None:
    project(pytester)
    run(pytester, "--garl-budget=24", "--garl-workers=0", "--junitxml=out.xml")
    text = (pytester.path / "out.xml").read_text()
    assert 'name="garl.signature" value="IV:dog:' in text


def test_importlib_mode_reaches_the_workers(pytester: pytest.Pytester) -> None:
    project(pytester)
    inline = SYSTEMS + TESTS.format(system="Good", maps="['lawn']").replace(
        "from systems import *", ""
    )
    pytester.makepyfile(test_it=inline)
    (pytester.path / "systems.py").unlink()
    result = run(
        pytester,
        "--garl-budget=8",
        "--garl-workers=1",
        "--import-mode=importlib",
        "-o",
        "pythonpath=.",
    )
    result.stdout.fnmatch_lines(["*8 flown*"])


def output_and_imports(pytester: pytest.Pytester, arguments: str, modules: str) -> str:
    """Return what pytest prints, and a last line that says which modules its process imported."""
    code = (
        "import sys, pytest\n"
        f"pytest.main({['-q', '-p', 'no:cacheprovider', *arguments.split()]})\n"
        f"print('HEAVY', sorted(set({modules.split()}) & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=pytester.path
    )
    return done.stdout


def test_a_search_leaves_the_camera_to_its_workers(pytester: pytest.Pytester) -> None:
    project(pytester, "Good", "['lawn']")
    arguments = "--garl-budget=4 --garl-shrink=0 --garl-workers=1"
    output = output_and_imports(pytester, arguments, "cv2 jinja2")
    assert "4 flown" in output
    assert "HEAVY []" in output


def test_a_run_without_landing_tests_imports_nothing_heavy(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_plain="def test_plain(): pass")
    heavy = "numpy cv2 pybullet pymoo torch hypothesis scipy"
    assert "HEAVY []" in output_and_imports(pytester, "-p no:hypothesispytest", heavy)


def test_the_plugin_can_be_left_out(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_plain="def test_plain(): pass")
    result = pytester.runpytest_subprocess("-p", "no:garl")
    result.assert_outcomes(passed=1)
