from __future__ import annotations

import pytest

from tests.support.landing_project import (
    TESTS,
    project,
    run,
)


@pytest.mark.parametrize(
    ("system", "maps", "words"),
    [
        ("Good", "['moon']", "*unknown map 'moon'; expected one of court, *lawn*"),
        ("NoStep", "['lawn']", "*NoStep has no method 'step'*"),
        ("Good()", "['lawn']", "*expected a class*"),
        ("(lambda: type('Local', (Good,), {}))()", "['lawn'], limits=dict(mass=1)", "*mass*"),
    ],
)
def test_an_invalid_marker_is_one_error_and_other_tests_run(
    pytester: pytest.Pytester, system: str, maps: str, words: str
) -> None:
    project(pytester, system, maps)
    pytester.makepyfile(test_other="def test_fine(): pass")
    result = run(pytester, "--garl-budget=8", "--continue-on-collection-errors")
    result.stdout.fnmatch_lines([words])
    result.assert_outcomes(passed=1, errors=1)


def test_a_marker_refuses_a_class_that_is_defined_in_a_function(pytester: pytest.Pytester) -> None:
    project(pytester)
    pytester.makepyfile(
        test_it=TESTS.format(system="make()", maps="['lawn']").replace(
            "pytestmark", "def make():\n    class Inner(Good): pass\n    return Inner\npytestmark"
        )
    )
    result = run(pytester, "--garl-budget=8")
    result.stdout.fnmatch_lines(["*is defined inside a function*"])


def test_a_marker_refuses_an_empty_list_of_maps(pytester: pytest.Pytester) -> None:
    project(pytester, maps="[]")
    result = run(pytester, "--garl-budget=2")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["*maps=[[]]: nothing to fly on; expected one or more of court*"])


def test_a_marker_refuses_an_unknown_limit_and_names_the_known_ones(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text().replace("maps=", "limits={'distance': 1}, maps="))
    result = run(pytester, "--garl-budget=2")
    result.stdout.fnmatch_lines(["*found distance, expected distance_m, time_s or abort, such as*"])
