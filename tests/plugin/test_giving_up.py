"""A system that gives up, or never lands, is red: whatever tests of the four a project has."""

from __future__ import annotations

import pytest

from tests.support.giving_up import write_four_tests
from tests.support.landing_project import run
from tests.support.search_tests import outcomes_of

SEARCH = ("--garl-budget=4", "--garl-workers=0", "-rf")
ALL, THREE, FOURTH = (), ("-k", "not completes"), ("-k", "completes")
SELECTIONS = {"four tests": ALL, "three tests": THREE, "only the fourth": FOURTH}
REPORTS = {
    "AbortNow": "test_lands_in_time",
    "HoverThenAbort": "test_lands_in_time",
    "TouchFarThenAbort": "test_lands_on_the_marker",
}
"""Each system, and the test that reports it if all four run."""
REVERSED = "\ndef pytest_collection_modifyitems(items):\n    items.reverse()\n"


def failing_tests(result: pytest.RunResult) -> list[str]:
    """Return the tests with failing items, an entry for each item."""
    return sorted(
        name.partition("::")[2].partition("[")[0] for name in outcomes_of(result, "FAILED")
    )


@pytest.mark.parametrize("selection", SELECTIONS.values(), ids=SELECTIONS)
@pytest.mark.parametrize("system", REPORTS)
def test_needless_giving_up_fails_one_test(
    pytester: pytest.Pytester, system: str, selection: tuple[str, ...]
) -> None:
    write_four_tests(pytester, system)
    result = run(pytester, *SEARCH, *selection)
    expected = "test_completes_the_mission" if selection == FOURTH else REPORTS[system]
    assert failing_tests(result) == [expected]
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(
        [
            f"{system} on lawn: 4 flown, landed 0 %, violations 100 %*",
            "  gave up: needless 100 %, excused 0 %, blocked 0 %; not landed 0 %",
            "  landed 0 %: no flight landed, so nothing is known of its landings",
        ]
    )


@pytest.mark.parametrize("selection", SELECTIONS.values(), ids=SELECTIONS)
@pytest.mark.parametrize(
    "how",
    [
        ("-p", "no:xdist"),
        pytest.param(("-n2",), marks=pytest.mark.long),
        pytest.param(("-n2", "--dist=loadscope"), marks=pytest.mark.long),
    ],
    ids=["alone", "xdist", "scope"],
)
def test_order_and_processes_do_not_change_which_item_fails(
    pytester: pytest.Pytester, selection: tuple[str, ...], how: tuple[str, ...]
) -> None:
    write_four_tests(pytester, "AbortNow")
    search = ("--garl-budget=4", "--garl-workers=1", "-rf", *selection)
    forwards = outcomes_of(run(pytester, *search), "FAILED")
    with (pytester.path / "conftest.py").open("a") as file:
        file.write(REVERSED)
    backwards = run(pytester, *search, *how)
    assert outcomes_of(backwards, "FAILED") == forwards
    assert backwards.ret == pytest.ExitCode.TESTS_FAILED


@pytest.mark.parametrize("selection", SELECTIONS.values(), ids=SELECTIONS)
def test_collision_and_landing_elsewhere_fail_one_item_each(
    pytester: pytest.Pytester, selection: tuple[str, ...]
) -> None:
    write_four_tests(pytester, "Good")
    result = run(pytester, "--garl-budget=16", "--garl-workers=0", "-rf", *selection)
    each = ["test_collides_with_nothing", "test_lands_on_the_marker"]
    fourth = ["test_completes_the_mission"] * 2
    assert failing_tests(result) == (fourth if selection == FOURTH else each)
    # What they fail for is built in; nobody takes it for a property of the user's own.
    result.stdout.no_fnmatch_line("*own:*")


OTHERS = {
    "skipped when it runs": "def test_other(landing):\n"
    "    assert landing.time_to_landing_s <= 120 or pytest.skip('not today')\n",
    "a fixture skips it": "@pytest.fixture(autouse=True)\n"
    "def not_today(request):\n"
    "    if request.node.originalname == 'test_other':\n"
    "        pytest.skip('not today')\n"
    "def test_other(landing):\n    assert landing.time_to_landing_s <= 120\n",
    "expected to fail": "@pytest.mark.xfail\n"
    "def test_other(landing):\n    assert landing.time_to_landing_s <= 120\n",
    "about another property": "def test_other(landing):\n    assert landing.slot == 'none'\n",
    "other fixtures": "def test_other(landing, tmp_path):\n"
    "    assert landing.time_to_landing_s > 120 or tmp_path\n",
    "a mark skips it": "@pytest.mark.skip\n"
    "def test_other(landing):\n    assert landing.time_to_landing_s <= 120\n",
}


@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_giving_up_is_red_although_the_other_test_does_not_fail_for_it(
    pytester: pytest.Pytester, other: str
) -> None:
    write_four_tests(pytester, "AbortNow")
    tests = pytester.path / "test_it.py"
    tests.write_text(f"{tests.read_text()}\n{other}")
    selection = ("-k", "test_completes or test_other")
    result = run(pytester, "--garl-budget=3", "--garl-workers=0", "-rf", *selection)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    if "fixture(autouse" in other:
        # Its fixture is not tried beforehand; the session notices in the end.
        result.stdout.fnmatch_lines(["3 tests excused by a failure that no test shows *"])
    else:
        assert "test_completes_the_mission" in failing_tests(result)


def test_two_tests_that_read_only_completed_do_not_wait_for_each_other(
    pytester: pytest.Pytester,
) -> None:
    write_four_tests(pytester, "AbortNow")
    tests = pytester.path / "test_it.py"
    again = "\ndef test_again(landing):\n    assert landing.completed\n"
    tests.write_text(tests.read_text() + again)
    result = run(pytester, *SEARCH, "-k", "completes or again")
    assert failing_tests(result) == ["test_again", "test_completes_the_mission"]


@pytest.mark.parametrize("selection", SELECTIONS.values(), ids=SELECTIONS)
def test_giving_up_is_allowed_by_the_limits(
    pytester: pytest.Pytester, selection: tuple[str, ...]
) -> None:
    write_four_tests(pytester, "HoverThenAbort")
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text().replace("maps=", "limits={'abort': 'ok'}, maps="))
    result = run(pytester, *SEARCH, "-rs", *selection)
    # No test fails, and yet nothing shows that it can land.
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert "failed" not in result.parseoutcomes()
    result.stdout.fnmatch_lines(
        [
            'garl: limits of HoverThenAbort: distance 0.75 m, time 120 s, abort="ok"',
            "HoverThenAbort on lawn: 4 flown, landed 0 %, violations 0 %*",
            "  by the paper's definition, which counts not landing: violations 100 %",
            "  gave up: needless 100 %, *",
            '  limits: distance 0.75 m, time 120 s, abort="ok"',
            "HoverThenAbort on lawn: landed within the limits in none of 4 flights, so*",
        ]
    )


@pytest.mark.sim
@pytest.mark.parametrize(
    "system",
    ["AbortNow", pytest.param("HoverThenAbort", marks=pytest.mark.long), "TouchFarThenAbort"],
)
def test_needless_giving_up_is_red_in_the_real_simulator(
    pytester: pytest.Pytester, system: str
) -> None:
    write_four_tests(pytester, system)
    (pytester.path / "conftest.py").unlink()
    # The weather of seed 0 is an excuse.
    flights = ("--garl-budget=1", "--garl-seed=2", "--garl-workers=0", "--garl-npcs=stationary")
    search = (*flights, "-rf")
    for index, selection in enumerate(SELECTIONS.values()):
        # Flown once; the other selections judge the same flight.
        resume = ("--garl-resume",) if index else ()
        result = run(pytester, *search, *resume, *selection)
        expected = "test_completes_the_mission" if selection == FOURTH else REPORTS[system]
        assert failing_tests(result) == [expected]
        assert result.ret == pytest.ExitCode.TESTS_FAILED


EXCUSED = """
import dataclasses
import tiny_simulator
from pytest_garl.flight.flight import MarkerView, NominalView

HIDDEN = MarkerView(share_in_frame=1.0, px_per_module=4.0, border_hidden=1.0, bits_hidden=1.0,
                    contrast=80.0, noise=3.0, blur_px=0.0)

def fly(*args, **options):
    flight = tiny_simulator.fly(*args, **options)
    view = NominalView(time_s=20.0, duration_s=30.0, place="search", height_m=10.0, marker=HIDDEN)
    return dataclasses.replace(flight, nominal_views=(view,))

def pytest_garl_fly(config):
    return fly
"""


@pytest.mark.parametrize("selection", SELECTIONS.values(), ids=SELECTIONS)
def test_giving_up_is_excused_where_nobody_can_read_the_marker(
    pytester: pytest.Pytester, selection: tuple[str, ...]
) -> None:
    write_four_tests(pytester, "HoverThenAbort")
    pytester.makepyfile(hidden=EXCUSED)
    pytester.makeconftest("from hidden import pytest_garl_fly")
    result = run(pytester, *SEARCH, "-v", *selection)
    # No test fails, and yet nothing shows that it can land.
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    tests = {"test_completes_the_mission": "PASSED", "test_lands_in_time": "SKIPPED"}
    unselected = {"not completes": "test_completes_the_mission", "completes": "test_lands_in_time"}
    tests.pop(unselected.get(selection[-1] if selection else "", ""), None)
    for test, word in tests.items():
        result.stdout.fnmatch_lines([f"test_it.py::{test}[[]lawn-g00-s00[]] {word}*"])
    result.stdout.fnmatch_lines(
        [
            "HoverThenAbort on lawn: 4 flown, landed 0 %, violations 0 % [[]0, 60[]]",
            "  by the paper's definition, which counts not landing: violations 100 %",
            "  gave up: needless 0 %, excused 100 %, blocked 0 %; not landed 0 %",
            "HoverThenAbort on lawn: landed within the limits in none of 4 flights, so*",
        ]
    )


def test_test_that_accepts_no_excuse_asserts_a_property_of_the_users_own(
    pytester: pytest.Pytester,
) -> None:
    write_four_tests(pytester, "HoverThenAbort")
    pytester.makepyfile(hidden=EXCUSED)
    pytester.makeconftest("from hidden import pytest_garl_fly")
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text().replace(" or landing.excused", ""))
    result = run(pytester, *SEARCH)
    assert failing_tests(result) == ["test_completes_the_mission"]
    result.stdout.fnmatch_lines(["own:test_completes_the_mission:*: a property of your own"])
