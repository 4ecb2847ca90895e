"""The outcomes of a search's items: who fails, and who is excused by whom."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project, run
from tests.support.search_tests import (
    COLLISIONS,
    DISTANCE,
    SEARCH_ALL,
    outcomes_of,
    write_simulator,
    write_tests,
)

PARALLEL = pytest.mark.parametrize("parallel", [(), ("-n2",)], ids=["alone", "xdist"])


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
def test_crash_fails_an_item_although_the_first_is_skipped_or_xfailed(
    pytester: pytest.Pytester, first: str, parallel: tuple[str, ...]
) -> None:
    write_tests(pytester, "Raises", first + DISTANCE + COLLISIONS)
    result = run(pytester, "--garl-budget=4", "--garl-workers=0", *parallel)
    found = result.parseoutcomes()
    assert (found["failed"], found.get("passed", 0), found.get("errors", 0)) == (1, 0, 0)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*ZeroDivisionError: no plan*"])


def test_violating_abort_fails_an_item_although_the_first_is_skipped(
    pytester: pytest.Pytester,
) -> None:
    skipped = "\n@pytest.mark.skip\ndef test_first(landing): pass\n"
    write_tests(pytester, "Good", skipped + DISTANCE + COLLISIONS)
    tests = pytester.path / "test_it.py"
    limited = tests.read_text().replace("maps=", "limits={'abort': 'violation'}, maps=")
    tests.write_text(limited)
    write_simulator(pytester, "dataclasses.replace(flight, outcome='gave_up')", "True")
    result = run(pytester, "--garl-budget=4", "--garl-workers=0")
    assert result.parseoutcomes()["failed"] == 1
    assert "passed" not in result.parseoutcomes()


def test_passing_item_excuses_no_other(pytester: pytest.Pytester) -> None:
    project(pytester)
    # Both slots are hit by the dog; the only selected test of the first one skips.
    selected = ("test_it.py::test_time[lawn-g00-s02]", "test_it.py::test_collisions[lawn-g00-s07]")
    result = run(pytester, *SEARCH_ALL, *selected)
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
def test_another_item_fails_if_the_first_of_a_kind_does_not(
    pytester: pytest.Pytester, plugin: str
) -> None:
    project(pytester)
    conftest = (pytester.path / "conftest.py").read_text()
    first = "FIRST = ('test_distance[lawn-g00-s00]', 'test_collisions[lawn-g00-s01]')\n"
    pytester.makeconftest(f"import pytest\n{conftest}\n{first}{plugin}")
    result = run(pytester, *SEARCH_ALL)
    assert len(outcomes_of(result, "FAILED")) == 2
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_xdist_fails_the_same_items(pytester: pytest.Pytester) -> None:
    project(pytester)
    alone = outcomes_of(run(pytester, *SEARCH_ALL), "FAILED")
    assert len(alone) == 2
    for how in ("worksteal", "loadscope"):
        result = run(pytester, *SEARCH_ALL[:1], "--garl-workers=0", "-rf", "-n2", f"--dist={how}")
        assert outcomes_of(result, "FAILED") == alone


@PARALLEL
def test_each_parameter_of_a_test_fails_once(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    parametrised = DISTANCE.replace("landing)", "landing, limit_m)").replace("1.5", "limit_m")
    given = "\n@pytest.mark.parametrize('limit_m', [1.5, 2.0])"
    write_tests(pytester, "Good", given + parametrised)
    result = run(pytester, *SEARCH_ALL[:1], "--garl-workers=0", "-rf", *parallel)
    failed = outcomes_of(result, "FAILED")
    assert sorted(name.rpartition("-")[2] for name in failed) == ["1.5]", "2.0]"]
    if not parallel:
        # Workers share the failure of a test with other fixtures: which slot it is, is theirs.
        assert all("lawn-g00-s00" in name for name in failed)
    assert result.parseoutcomes()["xfailed"] > 1


@pytest.mark.parametrize("body", ["raise TypeError('in the test')", "assert not landing.colisions"])
def test_error_of_a_test_is_no_violation(pytester: pytest.Pytester, body: str) -> None:
    write_tests(pytester, "Good", f"\ndef test_broken(landing):\n    {body}\n")
    result = run(pytester, "--garl-budget=8", "--garl-workers=0")
    result.assert_outcomes(failed=8)
    result.stdout.fnmatch_lines(["The test itself raised *Error; that violates no property.*"])
    result.stdout.no_fnmatch_line("Collided with dog-1*")


def test_pytest_fail_counts_as_an_assertion(pytester: pytest.Pytester) -> None:
    body = "\ndef test_hits(landing):\n    if landing.collisions:\n        pytest.fail('hit')\n"
    write_tests(pytester, "Good", body)
    result = run(pytester, *SEARCH_ALL)
    outcomes = result.parseoutcomes()
    assert outcomes["failed"] == 1
    assert outcomes["xfailed"] > 1
    result.stdout.fnmatch_lines(["*same violation as lawn-g00-s02 (IV:dog:*"])


OWN = """
import numpy as np

def is_below(value, limit):
    np.testing.assert_array_less(value, limit)

def test_own(landing, scenario):
    is_below(scenario["environment.snow"], 0.12)
    is_below(landing.flight.elapsed_s, 14.0 if scenario["environment.rain"] > 0.07 else 15.0)
"""


def test_report_parts_users_properties_and_no_violation_hides_them(
    pytester: pytest.Pytester,
) -> None:
    write_tests(pytester, "Good", COLLISIONS + OWN)
    result = run(pytester, *SEARCH_ALL)
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


def test_ground_contact_off_the_marker_before_an_abort_fails(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    touch = (
        "dataclasses.replace(flight, outcome='gave_up', contacts=(Contact(time_s=12.0, "
        "body='ground', kind='ground', body_class='ground', position_m=(40.0, 0.0, 0.0), "
        "speed_mps=0.5, tilt_rad=0.0),))"
    )
    write_simulator(pytester, touch, "True")
    result = run(pytester, "--garl-budget=4", "--garl-workers=0")
    # Two flights touch the ground 3 m off the marker; the others give up above it, needlessly.
    assert outcomes_of(result, "FAILED") == {
        "test_it.py::test_distance[lawn-g00-s00]",
        "test_it.py::test_time[lawn-g00-s01]",
    }


def test_resumed_run_reports_all_failures_again(pytester: pytest.Pytester) -> None:
    project(pytester)
    first = outcomes_of(run(pytester, *SEARCH_ALL), "FAILED")
    assert outcomes_of(run(pytester, *SEARCH_ALL, "--garl-resume"), "FAILED") == first
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
def test_rerun_item_does_not_excuse_itself(
    pytester: pytest.Pytester, system: str, failures: int
) -> None:
    project(pytester, system)
    conftest = (pytester.path / "conftest.py").read_text()
    pytester.makeconftest(f"{conftest}\n{TWICE}")
    result = run(pytester, "--garl-budget=16", "--garl-workers=0")
    assert result.parseoutcomes()["failed"] == failures
    assert result.parseoutcomes()["xfailed"] > 1


def test_users_property_that_fails_only_in_collisions_is_not_saved(
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


TOUCHES_AND_GIVES_UP = """
import dataclasses

import tiny_simulator
from pytest_garl.flight.flight import Contact
from pytest_garl.flight.flight_file import hash_of


def fly(*args, **options):
    flight = tiny_simulator.fly(*args, **options)
    touch = Contact(
        time_s=14.2,
        body="ground",
        kind="ground",
        body_class="ground",
        position_m=(0.0, 0.0, 0.0),
        speed_mps=0.5,
        tilt_rad=0.0,
    )
    changed = dataclasses.replace(flight, outcome="gave_up", contacts=(touch,), crash=None)
    return dataclasses.replace(changed, sha256=hash_of(changed))
"""


def test_ground_contact_before_an_abort_fails_the_search(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    pytester.makepyfile(gives_up=TOUCHES_AND_GIVES_UP)
    conftest = pytester.path / "conftest.py"
    conftest.write_text(conftest.read_text().replace("tiny_simulator", "gives_up"))
    # In fog it comes down 3 m off the marker.
    (pytester.path / "fog.toml").write_text('extends = "paper"\npaper = "full"\n')
    result = run(pytester, "--garl-budget=6", "--garl-workers=0", "--garl-domain=fog.toml")
    # Elsewhere it gives up above the marker, needlessly.
    assert result.parseoutcomes()["failed"] == 2
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*Touched the ground 3.0 m off the marker before it gave up*"])
    result.stdout.fnmatch_lines(["* I:nothing:unseen * pytest test_it.py --garl-repeat=lawn-g*"])
    result.stdout.fnmatch_lines(["FAILED test_it.py::test_distance*"])
