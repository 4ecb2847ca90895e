"""Red means broken, green means safe: what excuses a failing item, and what does not."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project, run

PARALLEL = pytest.mark.parametrize("parallel", [(), ("-n2",)], ids=["alone", "xdist"])


def write_tests(pytester: pytest.Pytester, system: str, tests: str) -> None:
    project(pytester, system)
    head = (
        "import pytest\nfrom systems import *\n"
        f"pytestmark = pytest.mark.garl(system={system}, maps=['lawn'])\n"
    )
    (pytester.path / "test_it.py").write_text(head + tests)


COLLISIONS = "\ndef test_collisions(landing):\n    assert not landing.collisions\n"
DISTANCE = "\ndef test_distance(landing):\n    assert landing.distance_to_landing_m <= 1.5\n"


@pytest.mark.parametrize(
    ("first", "parallel"),
    [
        ("\n@pytest.mark.skip\ndef test_first(landing): pass\n", ()),
        ("\n@pytest.mark.xfail(reason='known')\ndef test_first(landing): pass\n", ("-n2",)),
        ("\ndef test_first(scenario): assert scenario.map == 'lawn'\n", ()),
        (
            "\n@pytest.fixture\ndef absent(landing): pytest.skip('no camera')\n"
            "def test_first(absent, landing): pass\n",
            (),
        ),
    ],
    ids=["skipped", "xfailed", "scenario", "fixture"],
)
def test_a_crash_fails_an_item_whatever_happens_to_the_first(
    pytester: pytest.Pytester, first: str, parallel: tuple[str, ...]
) -> None:
    write_tests(pytester, "Raises", first + DISTANCE + COLLISIONS)
    result = run(pytester, "--garl-budget=4", "--garl-workers=1", *parallel)
    found = result.parseoutcomes()
    assert (found["failed"], found.get("passed", 0), found.get("errors", 0)) == (1, 0, 0)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*ZeroDivisionError: no plan*"])


def test_a_violating_abort_fails_an_item_though_the_first_is_skipped(
    pytester: pytest.Pytester,
) -> None:
    skipped = "\n@pytest.mark.skip\ndef test_first(landing): pass\n"
    write_tests(pytester, "Good", skipped + DISTANCE + COLLISIONS)
    tests = pytester.path / "test_it.py"
    limited = tests.read_text().replace("maps=", "limits={'abort': 'violation'}, maps=")
    tests.write_text(limited)
    write_simulator(pytester, "dataclasses.replace(flight, outcome='aborted')", "True")
    result = run(pytester, "--garl-budget=4", "--garl-workers=0")
    assert result.parseoutcomes()["failed"] == 1
    assert "passed" not in result.parseoutcomes()


SEARCH = ("--garl-budget=24", "--garl-workers=0", "-rfx")


def outcomes_of(result: pytest.RunResult, word: str) -> set[str]:
    """Return the ids of the items of which the short summary says so."""
    lines = [line for line in result.outlines if line.startswith(f"{word} ")]
    return {line.removeprefix(f"{word} ").split(" - ")[0] for line in lines}


def test_no_item_is_excused_by_one_that_did_not_fail(pytester: pytest.Pytester) -> None:
    project(pytester)
    # Both slots are hit by the dog; the only selected test of the first one skips.
    selected = ("test_it.py::test_time[lawn-g00-s01]", "test_it.py::test_collisions[lawn-g00-s02]")
    result = run(pytester, *SEARCH, *selected)
    result.assert_outcomes(skipped=1, failed=1)
    assert result.ret == pytest.ExitCode.TESTS_FAILED


@pytest.mark.parametrize(
    "plugin",
    [
        "def pytest_collection_modifyitems(items):\n"
        "    for item in items:\n"
        "        if item.name in FIRST:\n"
        "            item.add_marker(pytest.mark.xfail)\n",
        "def pytest_collection_modifyitems(items):\n"
        "    for item in items:\n"
        "        if item.name in FIRST:\n"
        "            item.add_marker(pytest.mark.skip)\n",
        "def pytest_collection_modifyitems(items):\n"
        "    items[:] = [item for item in items if item.name not in FIRST]\n",
    ],
    ids=["xfailed", "skipped", "deselected"],
)
def test_another_item_fails_where_the_first_of_a_kind_does_not(
    pytester: pytest.Pytester, plugin: str
) -> None:
    project(pytester)
    conftest = (pytester.path / "conftest.py").read_text()
    first = "FIRST = ('test_distance[lawn-g00-s00]', 'test_collisions[lawn-g00-s01]')\n"
    pytester.makeconftest(f"import pytest\n{conftest}\n{first}{plugin}")
    result = run(pytester, *SEARCH)
    assert len(outcomes_of(result, "FAILED")) == 2
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_xdist_fails_the_same_items(pytester: pytest.Pytester) -> None:
    project(pytester)
    alone = outcomes_of(run(pytester, *SEARCH), "FAILED")
    assert len(alone) == 2
    for how in ("worksteal", "loadscope"):
        result = run(pytester, *SEARCH[:1], "--garl-workers=1", "-rf", "-n2", f"--dist={how}")
        assert outcomes_of(result, "FAILED") == alone


@PARALLEL
def test_each_parameter_of_a_test_fails_once(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    parametrised = DISTANCE.replace("landing)", "landing, limit_m)").replace("1.5", "limit_m")
    given = "\n@pytest.mark.parametrize('limit_m', [1.5, 2.0])"
    write_tests(pytester, "Good", given + parametrised)
    result = run(pytester, *SEARCH[:1], "--garl-workers=1", "-rf", *parallel)
    failed = outcomes_of(result, "FAILED")
    assert sorted(name.rpartition("-")[2] for name in failed) == ["1.5]", "2.0]"]
    if not parallel:
        # Workers share the failure of a test with other fixtures: which slot it is, is theirs.
        assert all("lawn-g00-s00" in name for name in failed)
    assert result.parseoutcomes()["xfailed"] > 1


def test_a_session_is_not_green_if_somebody_hides_the_failure_that_excuses_others(
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
    result = run(pytester, *SEARCH)
    assert "failed" not in result.parseoutcomes()
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*garl: this run is not green*", "*by a failure that no test*"])


@pytest.mark.parametrize("body", ["raise TypeError('in the test')", "assert not landing.colisions"])
def test_an_exception_that_is_no_assertion_is_no_violation(
    pytester: pytest.Pytester, body: str
) -> None:
    write_tests(pytester, "Good", f"\ndef test_broken(landing):\n    {body}\n")
    result = run(pytester, "--garl-budget=8", "--garl-workers=0")
    result.assert_outcomes(failed=8)
    result.stdout.fnmatch_lines(["The test itself raised *Error; that violates no property.*"])
    result.stdout.no_fnmatch_line("Collided with dog-1*")


def test_a_failure_by_pytest_fail_counts_as_an_assertion(pytester: pytest.Pytester) -> None:
    body = "\ndef test_hits(landing):\n    if landing.collisions:\n        pytest.fail('hit')\n"
    write_tests(pytester, "Good", body)
    result = run(pytester, *SEARCH)
    outcomes = result.parseoutcomes()
    assert outcomes["failed"] == 1
    assert outcomes["xfailed"] > 1
    result.stdout.fnmatch_lines(["*same violation as lawn-g00-s01 (IV:dog:*"])


OWN = """
import numpy as np

def is_below(value, limit):
    np.testing.assert_array_less(value, limit)

def test_own(landing, scenario):
    is_below(scenario["environment.snow"], 0.07)
    is_below(landing.flight.elapsed_s, 14.0 if scenario["environment.rain"] > 0.07 else 15.0)
"""


def test_properties_of_ones_own_are_told_apart_and_hidden_by_no_violation(
    pytester: pytest.Pytester,
) -> None:
    write_tests(pytester, "Good", COLLISIONS + OWN)
    result = run(pytester, *SEARCH)
    failed = outcomes_of(result, "FAILED")
    # Two statements of one test, in flights that hit the dog and in flights that do not.
    assert sorted(name.partition("[")[0] for name in failed) == [
        "test_it.py::test_collisions",
        "test_it.py::test_own",
        "test_it.py::test_own",
    ]
    expected = [line for line in result.outlines if line.startswith("XFAIL") and "test_own" in line]
    assert expected
    assert all("(own:test_own:" in line for line in expected)


SIMULATOR = """
import dataclasses
import tiny_simulator
from pytest_garl.simulation.flight import Contact

def fly(scenario, *args, **kwargs):
    flight = tiny_simulator.fly(scenario, *args, **kwargs)
    return {change} if {when} else flight
"""


def write_simulator(pytester: pytest.Pytester, change: str, when: str) -> None:
    (pytester.path / "simulator.py").write_text(SIMULATOR.format(change=change, when=when))
    pytester.makeconftest("import simulator\ndef pytest_garl_fly(config): return simulator.fly\n")


@PARALLEL
def test_too_many_flights_without_a_result_fail_the_run(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    write_tests(pytester, "Good", "\ndef test_lands(landing): assert landing.outcome\n")
    slow = "dataclasses.replace(flight, outcome='inconclusive')"
    write_simulator(pytester, slow, "scenario.seed % 2 == 0")
    result = run(pytester, "--garl-budget=20", "--garl-workers=1", *parallel)
    assert "failed" not in result.parseoutcomes()
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["Good on lawn: * of 20 flights are inconclusive, at most 1 may*"])


def test_a_repeat_without_a_result_fails(pytester: pytest.Pytester) -> None:
    write_tests(pytester, "Good", COLLISIONS + DISTANCE)
    slow = "dataclasses.replace(flight, outcome='inconclusive')"
    write_simulator(pytester, slow, "True")
    run(pytester, "--garl-budget=1", "--garl-workers=0")
    result = run(pytester, "--garl-workers=0", "--garl-repeat=lawn-g00-s00")
    result.assert_outcomes(failed=1, skipped=1)
    result.stdout.fnmatch_lines(["*inconclusive:*Nothing was decided*"])


def test_touching_the_ground_off_the_marker_before_an_abort_is_red(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    touch = (
        "dataclasses.replace(flight, outcome='aborted', contacts=(Contact(time_s=12.0, "
        "body='ground', kind='ground', body_class='ground', position_m=(40.0, 0.0, 0.0), "
        "speed_mps=0.5, tilt_rad=0.0),))"
    )
    write_simulator(pytester, touch, "True")
    result = run(pytester, "--garl-budget=4", "--garl-workers=0")
    assert outcomes_of(result, "FAILED") == {"test_it.py::test_distance[lawn-g00-s00]"}


def test_a_run_that_flies_nothing_says_so(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "-q")
    assert result.ret == 0
    result.stdout.fnmatch_lines(["garl: nothing was flown: no --garl-budget given and no saved*"])
    skipping = "\npytestmark = [pytestmark, pytest.mark.skip]\n"
    (pytester.path / "test_it.py").write_text((pytester.path / "test_it.py").read_text() + skipping)
    result = run(pytester, "--garl-budget=4")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["nothing was flown, although flights were asked for: all lan*"])


def test_a_violation_that_no_test_asserts_is_noted(pytester: pytest.Pytester) -> None:
    write_tests(pytester, "Good", COLLISIONS)
    result = run(pytester, "--garl-budget=1", "--garl-workers=0")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["garl: no selected test fails for *: I[?]:unknown (1 flight)"])


def test_a_run_without_landing_tests_says_nothing(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_plain="def test_plain(): pass")
    result = run(pytester)
    result.stdout.no_fnmatch_line("*garl: *")


def test_a_resumed_run_shows_all_failures_again(pytester: pytest.Pytester) -> None:
    project(pytester)
    first = outcomes_of(run(pytester, *SEARCH), "FAILED")
    assert outcomes_of(run(pytester, *SEARCH, "--garl-resume"), "FAILED") == first
    assert len(first) == 2


TWICE = """
from _pytest.runner import runtestprotocol

def pytest_runtest_protocol(item, nextitem):
    runtestprotocol(item, nextitem=nextitem, log=False)
    item._initrequest()
    for report in runtestprotocol(item, nextitem=nextitem, log=False):
        item.ihook.pytest_runtest_logreport(report=report)
    return True
"""


@pytest.mark.parametrize(("system", "failures"), [("Good", 2), ("Raises", 1)])
def test_an_item_that_is_run_again_excuses_not_itself(
    pytester: pytest.Pytester, system: str, failures: int
) -> None:
    project(pytester, system)
    conftest = (pytester.path / "conftest.py").read_text()
    pytester.makeconftest(f"{conftest}\n{TWICE}")
    result = run(pytester, "--garl-budget=8", "--garl-workers=0")
    assert result.parseoutcomes()["failed"] == failures
    assert result.parseoutcomes()["xfailed"] > 1


def test_an_own_property_that_fails_only_in_collisions_is_told_and_not_saved(
    pytester: pytest.Pytester,
) -> None:
    own = "\ndef test_own(landing):\n    assert landing.flight.outcome != 'collision'\n"
    write_tests(pytester, "Good", COLLISIONS + own)
    search = ("--garl-budget=12", "--garl-workers=0", "--garl-shrink=10")
    result = run(pytester, *search)
    assert result.parseoutcomes()["failed"] == 2
    result.stdout.fnmatch_lines(
        ["It is saved only if it also fails in a flight that violates nothing*"]
    )
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    files = (pytester.path / "scenarios" / "regressions" / "systems").glob("*.toml")
    assert not any("-own-" in path.name for path in files)
