"""The exit status of a session: decided from facts alone, and in real sessions."""

from __future__ import annotations

import pytest

from pytest_garl.plugin.session.session_status import SessionFacts, exit_status
from tests.support.landing_project import project, run
from tests.support.search_tests import (
    COLLISIONS,
    DISTANCE,
    SEARCH_ALL,
    write_simulator,
    write_tests,
)

ExitCode = pytest.ExitCode
GREEN, RED, EMPTY = ExitCode.OK, ExitCode.TESTS_FAILED, ExitCode.NO_TESTS_COLLECTED
INTERRUPTED, USAGE, INTERNAL = (
    ExitCode.INTERRUPTED,
    ExitCode.USAGE_ERROR,
    ExitCode.INTERNAL_ERROR,
)


@pytest.mark.parametrize(
    ("status", "facts", "decided"),
    [
        (GREEN, SessionFacts(), GREEN),
        (RED, SessionFacts(), RED),
        (GREEN, SessionFacts(problems=True), RED),
        (RED, SessionFacts(problems=True), RED),
        (INTERRUPTED, SessionFacts(problems=True), INTERRUPTED),
        (GREEN, SessionFacts(broken=True), INTERNAL),
        (RED, SessionFacts(broken=True, problems=True), INTERNAL),
        (GREEN, SessionFacts(nothing_compared=True), USAGE),
        (EMPTY, SessionFacts(nothing_compared=True), USAGE),
        (RED, SessionFacts(nothing_compared=True), RED),
        (GREEN, SessionFacts(nothing_compared=True, problems=True), USAGE),
        (GREEN, SessionFacts(interrupted=True), INTERRUPTED),
        (RED, SessionFacts(interrupted=True, problems=True), INTERRUPTED),
        (GREEN, SessionFacts(interrupted=True, broken=True), INTERNAL),
    ],
)
def test_exit_status_is_worst_of_items_and_session(
    status: int, facts: SessionFacts, decided: int
) -> None:
    assert exit_status(status, facts) == decided


PARALLEL = pytest.mark.parametrize(
    "parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)], ids=["alone", "xdist"]
)


def test_session_is_not_green_if_a_plugin_hides_the_failure_that_excuses_others(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    conftest = (pytester.path / "conftest.py").read_text()
    pytester.makeconftest(
        f"import pytest\n{conftest}\n"
        "@pytest.hookimpl(wrapper=True, tryfirst=True)\n"
        "def pytest_runtest_makereport(item, call):\n"
        "    report = yield\n"
        "    if report.failed: report.outcome = 'passed'\n"
        "    return report\n"
    )
    result = run(pytester, *SEARCH_ALL)
    assert "failed" not in result.parseoutcomes()
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*garl: this run is not green*", "*by a failure that no test*"])


@PARALLEL
def test_too_many_inconclusive_flights_fail_the_run(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    write_tests(pytester, "Good", "\ndef test_lands(landing): assert landing.outcome\n")
    slow = "dataclasses.replace(flight, outcome='inconclusive')"
    write_simulator(pytester, slow, "scenario.seed % 2 == 0")
    result = run(pytester, "--garl-budget=20", "--garl-workers=0", *parallel)
    assert "failed" not in result.parseoutcomes()
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["Good on lawn: * of 20 flights are inconclusive, at most 1 may*"])


def test_repeat_fails_if_its_flight_is_inconclusive(pytester: pytest.Pytester) -> None:
    write_tests(pytester, "Good", COLLISIONS + DISTANCE)
    slow = "dataclasses.replace(flight, outcome='inconclusive')"
    write_simulator(pytester, slow, "True")
    run(pytester, "--garl-budget=1", "--garl-workers=0")
    result = run(pytester, "--garl-workers=0", "--garl-repeat=lawn-g00-s00")
    result.assert_outcomes(failed=1, skipped=1)
    result.stdout.fnmatch_lines(["*inconclusive:*Nothing was decided*"])


def test_summary_says_why_nothing_was_flown(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "-q")
    assert result.ret == 0
    result.stdout.fnmatch_lines(["garl: nothing was flown: no --garl-budget given and no saved*"])
    skipping = "\npytestmark = [pytestmark, pytest.mark.skip]\n"
    (pytester.path / "test_it.py").write_text((pytester.path / "test_it.py").read_text() + skipping)
    result = run(pytester, "--garl-budget=4")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["nothing was flown, although flights were asked for: all lan*"])


def test_summary_notes_a_violation_that_no_test_asserts(pytester: pytest.Pytester) -> None:
    write_tests(pytester, "Good", COLLISIONS)
    result = run(pytester, "--garl-budget=2", "--garl-workers=0")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["garl: no selected test fails for *: I:nothing:unseen (1 flight)"])


@pytest.mark.parametrize(
    ("ci", "key", "status"),
    [
        ("true", (), RED),
        ("", (), GREEN),
        ("true", ("-o", "garl_unasserted=note"), GREEN),
        ("", ("-o", "garl_unasserted=fail"), RED),
        ("", ("-o", "garl_unasserted=maybe"), USAGE),
    ],
)
def test_ini_key_says_what_a_violation_is_that_no_test_asserts(
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    ci: str,
    key: tuple[str, ...],
    status: int,
) -> None:
    write_tests(pytester, "Good", COLLISIONS)
    monkeypatch.setenv("CI", ci)
    result = run(pytester, "--garl-budget=2", "--garl-workers=0", *key)
    assert result.ret == status
    output = result.stdout.str() + result.stderr.str()
    expected = "garl_unasserted: found 'maybe'" if status == USAGE else "no selected test fails for"
    assert expected in output


TWO_SYSTEMS = """
import pytest
from systems import Good

class Other(Good):
    pass

@pytest.mark.garl(system=Good, maps=["lawn"])
def test_good(landing):
    assert landing.distance_to_landing_m <= 1.5

@pytest.mark.garl(system=Other, maps=["lawn"])
def test_other(landing):
    assert not landing.collisions
"""


def test_a_failure_of_one_system_asserts_no_violation_of_another(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", "true")
    project(pytester)
    (pytester.path / "test_it.py").write_text(TWO_SYSTEMS)
    result = run(pytester, "--garl-budget=2", "--garl-workers=0")
    result.assert_outcomes(failed=1, passed=3)
    result.stdout.fnmatch_lines(["no selected test fails for *: I:nothing:unseen (1 flight)"])


def test_summary_notes_a_violation_whose_tests_are_all_expected_to_fail(
    pytester: pytest.Pytester,
) -> None:
    write_tests(pytester, "Good", f"pytestmark = [pytestmark, pytest.mark.xfail]\n{DISTANCE}")
    result = run(pytester, "--garl-budget=2", "--garl-workers=0")
    result.assert_outcomes(xfailed=1, xpassed=1)
    result.stdout.fnmatch_lines(["garl: no selected test fails for *: I:nothing:unseen (1 flight)"])


def test_stopped_session_says_nothing_of_tests_that_did_not_run(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    completed = "def test_completes(landing):\n    assert landing.completed\n"
    write_tests(pytester, "Good", completed + COLLISIONS + DISTANCE)
    monkeypatch.setenv("CI", "true")
    result = run(pytester, "--garl-budget=8", "--garl-workers=0", "-x")
    assert result.ret == RED
    result.assert_outcomes(failed=1, passed=7, skipped=3)
    result.stdout.no_fnmatch_line("*no selected test fails*")
    result.stdout.no_fnmatch_line("*excused by a failure*")


@pytest.mark.parametrize(
    "tests",
    [
        "\ndef test_reads_nothing(landing): pass\n",
        "\n@pytest.fixture\ndef flown(landing):\n    yield\n"
        "    assert not landing.collisions and landing.final_distance_m < 1\n"
        "def test_at_the_end(flown): pass\n",
    ],
    ids=["in another file", "in a fixture's teardown"],
)
def test_a_violation_is_asserted_wherever_a_test_fails_for_its_flight(
    pytester: pytest.Pytester, tests: str
) -> None:
    write_tests(pytester, "Good", tests)
    if "teardown" not in tests and "yield" not in tests:
        text = (pytester.path / "test_it.py").read_text()
        asserting = text.replace(tests, COLLISIONS + DISTANCE)
        (pytester.path / "test_that.py").write_text(asserting)
    result = run(pytester, "--garl-budget=8", "--garl-workers=0")
    assert result.ret == RED
    result.stdout.no_fnmatch_line("*no selected test fails*")


def test_budget_of_an_ini_key_asks_nothing_of_a_session_without_landing_tests(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(test_plain="def test_plain(): pass")
    result = run(pytester, "-o", "garl_budget=4")
    assert result.ret == GREEN
    result.stdout.no_fnmatch_line("*nothing was flown*")


def test_session_without_landing_tests_reports_nothing(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_plain="def test_plain(): pass")
    result = run(pytester)
    result.stdout.no_fnmatch_line("*garl: *")
