"""Searches in test suites with habits and plugins of their own: red if something is violated."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass, field

import pytest

from tests.support.landing_project import CONFTEST, project, run

CALM = """
import tiny_simulator
def calm(scenario, *args, **options):
    nominal = {"environment.fog": 0.0, "dog-1.velocity": 0.1}
    return tiny_simulator.fly(scenario.replace(nominal), *args, **options)
def pytest_garl_fly(config): return calm
"""
"""A conftest.py with which every flight lands well."""
HEAD = (
    "import pytest\nfrom systems import *\n"
    "pytestmark = pytest.mark.garl(system=Good, maps=['lawn'])\n"
)
SUBTESTS = f"""{HEAD}
def test_lands(landing, subtests):
    with subtests.test("collisions"):
        assert not landing.collisions
    with subtests.test("distance"):
        assert landing.final_distance_m <= 1.5
"""
SKIPS = """
import pytest
collect_ignore = ["test_ignored.py"]
def pytest_collection_modifyitems(items):
    for item in items:
        if "slow" in item.keywords:
            item.add_marker(pytest.mark.skip(reason="slow"))
"""
CLASSES = f"""{HEAD}
import unittest

@pytest.fixture
def limit_m(landing): return landing.limits.distance_m

class TestLanding:
    def test_distance(self, landing, limit_m): assert landing.distance_to_landing_m <= limit_m
    def test_collisions(self, landing): assert not landing.collisions
"""
PARAMETERS = """
import pytest
from systems import *

class Other(Good): pass

def mark(system): return pytest.mark.garl(system=system, maps=["lawn"])

@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(
    "system", [pytest.param(Good, marks=mark(Good)), pytest.param(Other, marks=mark(Other))]
)
def test_lands(landing, system, side):
    assert not landing.collisions
    assert landing.distance_to_landing_m <= 1.5
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Habit:
    """Files that a suite has beside the landing tests, or in their place, and its options."""

    files: Mapping[str, str] = field(default_factory=dict)
    conftest: str = ""
    args: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    """The modules of its plugins."""


HABITS = {
    "skips": Habit(
        files={
            "test_absent.py": "import pytest\npytest.importorskip('no_such')\n",
            "test_later.py": "import pytest\npytest.skip('later', allow_module_level=True)\n",
            "test_other.py": "import pytest\n@pytest.mark.slow\ndef test_a(): assert 0\n",
            "test_ignored.py": "raise RuntimeError('not for this machine')",
            "pytest.ini": "[pytest]\ngarl_domain = paper\nmarkers = slow: slow\n",
        },
        conftest=SKIPS,
    ),
    "ignores its children": Habit(
        conftest="import signal\nsignal.signal(signal.SIGCHLD, signal.SIG_IGN)\n",
        args=("--garl-workers=1",),
    ),
    "subtests": Habit(files={"test_it.py": SUBTESTS}),
    "classes and fixtures": Habit(files={"test_it.py": CLASSES}),
    "marked parameters": Habit(files={"test_it.py": PARAMETERS}),
    "rerunfailures": Habit(
        args=("-p", "rerunfailures", "--reruns=1"), needs=("pytest_rerunfailures",)
    ),
    "retry": Habit(args=("-p", "pytest-retry", "--retries=1"), needs=("pytest_retry",)),
    "flaky": Habit(args=("-p", "flaky", "--force-flaky"), needs=("flaky",)),
    "randomly, timeout and cov": Habit(
        args=(
            *("-p", "randomly", "--randomly-seed=1"),
            *("-p", "timeout", "--timeout=60"),
            *("-p", "pytest_cov", "--cov=systems"),
        ),
        needs=("pytest_randomly", "pytest_timeout", "pytest_cov"),
    ),
    "xdist": Habit(
        files={"test_absent.py": "import pytest\npytest.importorskip('no_such')\n"},
        args=("-n2", "--garl-workers=1"),
    ),
}


def _session(pytester: pytest.Pytester, habit: Habit, simulator: str) -> pytest.RunResult:
    missing = [name for name in habit.needs if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")
    project(pytester)
    for file, text in habit.files.items():
        (pytester.path / file).write_text(text)
    (pytester.path / "conftest.py").write_text(simulator + habit.conftest)
    return run(pytester, "--garl-budget=4", "--garl-workers=0", *habit.args)


@pytest.mark.parametrize("name", HABITS)
def test_a_clean_search_is_green_in_a_suite_with_habits(
    pytester: pytest.Pytester, name: str
) -> None:
    result = _session(pytester, HABITS[name], CALM)
    assert result.ret == pytest.ExitCode.OK
    result.stdout.fnmatch_lines(["*on lawn: 4 flown, landed 100 %*", "ledger: *"])
    assert "make of CPU" not in result.stdout.str(), "what is bred does not depend on it"


@pytest.mark.parametrize("name", HABITS)
def test_a_violation_is_red_in_a_suite_with_habits(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv("CI", "true")
    result = _session(pytester, HABITS[name], CONFTEST)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*on lawn: 4 flown, landed 75 %*", "ledger: *"])
    output = result.stdout.str() + result.stderr.str()
    assert "INTERNALERROR" not in output
    # Its tests assert it, whatever runs them.
    assert "no selected test fails" not in output
    assert "this run is not green" not in output


def test_marked_parameters_fly_their_own_systems(pytester: pytest.Pytester) -> None:
    project(pytester)
    (pytester.path / "test_it.py").write_text(PARAMETERS)
    result = run(pytester, "--garl-budget=1", "--collect-only", "-q")
    result.stdout.fnmatch_lines(
        [
            "test_it.py::test_lands[[]Good-left-lawn-g00-s00[]]",
            "test_it.py::test_lands[[]Good-right-lawn-g00-s00[]]",
            "test_it.py::test_lands[[]Other-left-lawn-g00-s00[]]",
            "test_it.py::test_lands[[]Other-right-lawn-g00-s00[]]",
        ]
    )
    result = run(pytester, "--garl-budget=1", "--garl-workers=0")
    result.stdout.fnmatch_lines(["Good on lawn: 1 flown*", "Other on lawn: 1 flown*"])


def test_a_mark_of_a_parameter_wins_over_the_mark_of_the_module(pytester: pytest.Pytester) -> None:
    project(pytester)
    marked = PARAMETERS + "\npytestmark = pytest.mark.garl(system=Raises, maps=['court'])\n"
    (pytester.path / "test_it.py").write_text(marked)
    result = run(pytester, "--garl-budget=1", "--garl-workers=0")
    result.stdout.fnmatch_lines(["Good on lawn: 1 flown*", "Other on lawn: 1 flown*"])
    result.stdout.no_fnmatch_line("*Raises*")


def test_a_parameter_without_a_mark_is_an_error_that_names_it(pytester: pytest.Pytester) -> None:
    project(pytester)
    unmarked = PARAMETERS.replace("pytest.param(Good, marks=mark(Good))", "Good")
    (pytester.path / "test_it.py").write_text(unmarked)
    result = run(pytester, "--garl-budget=1")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["*test_lands[[]Good-left[]] uses a landing fixture without*"])


UNITTEST = """
import unittest, pytest
from systems import *
{decorators}
class TestLands(unittest.TestCase):
    {fixture}
    def test_a(self): pass
"""


@pytest.mark.parametrize(
    "test",
    [
        "def test_a(request): request.getfixturevalue('landing')",
        UNITTEST.format(decorators="@pytest.mark.usefixtures('landing')", fixture=""),
        UNITTEST.format(
            decorators="",
            fixture="@pytest.fixture(autouse=True)\n    def flown(self, landing): pass",
        ),
    ],
    ids=["getfixturevalue", "usefixtures", "autouse"],
)
def test_a_test_that_cannot_have_items_fails_with_one_sentence(
    pytester: pytest.Pytester, test: str
) -> None:
    project(pytester)
    (pytester.path / "test_it.py").write_text(test)
    result = run(pytester, "--garl-budget=1", "--garl-workers=0")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*test_a: the fixture 'landing' needs an item for each flight*"])
    result.stdout.no_fnmatch_line("*AttributeError*")


@pytest.mark.parametrize("fixture", ["", "@pytest.mark.usefixtures('landing')"])
def test_a_marked_unittest_class_is_an_error_at_collection(
    pytester: pytest.Pytester, fixture: str
) -> None:
    project(pytester)
    marked = f"@pytest.mark.garl(system=Good)\n{fixture}"
    (pytester.path / "test_it.py").write_text(UNITTEST.format(decorators=marked, fixture=""))
    result = run(pytester)
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["test_it.py::TestLands::test_a: *landing*"])
