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
        ("Good", "['lawn'], limits=dict(mass=1)", "*mass*"),
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


@pytest.mark.parametrize("maps", ["3", "['lawn', None]", "(each for each in ['lawn'])"])
def test_a_marker_refuses_maps_that_are_no_list_of_names(
    pytester: pytest.Pytester, maps: str
) -> None:
    project(pytester, maps=maps)
    result = run(pytester, "--garl-budget=2")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["*mark.garl: maps=*: expected a list of names, as [[]'court', *"])


def test_a_map_that_is_named_twice_is_flown_once(pytester: pytest.Pytester) -> None:
    project(pytester, maps="['lawn', 'lawn']")
    result = run(pytester, "--garl-budget=1", "--garl-workers=0", "--collect-only", "-q")
    assert result.outlines.count("test_it.py::test_time[lawn-g00-s00]") == 1


def test_a_marker_refuses_a_class_that_its_module_does_not_hold_by_its_name(
    pytester: pytest.Pytester,
) -> None:
    project(pytester, "Made")
    with (pytester.path / "systems.py").open("a") as systems:
        systems.write("\nMade = type('Other', (Good,), {})\n")
    result = run(pytester, "--garl-budget=2")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["*system=Other: the module systems has no class of this name*"])


def test_a_marker_refuses_an_unknown_limit_and_names_the_known_ones(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text().replace("maps=", "limits={'distance': 1}, maps="))
    result = run(pytester, "--garl-budget=2")
    result.stdout.fnmatch_lines(["*found distance, expected distance_m, time_s or abort, such as*"])


def test_a_marker_that_names_its_class_by_text_says_how_to_import_it(
    pytester: pytest.Pytester,
) -> None:
    project(pytester, system="'systems:Good'")
    result = run(pytester)
    assert result.ret == pytest.ExitCode.INTERRUPTED
    output = " ".join(result.stdout.str().split())
    words = "import it: from systems import Good, and give system=Good"
    assert f"expected a class, found its name; {words}" in output


@pytest.mark.parametrize(
    ("argument", "words"),
    [
        ("limits=pytest_garl.limits(distance=1)", "*found distance, expected distance_m*"),
        ("limits=pytest_garl.limits(time_s=-1)", "*found time_s=-1, expected a number*"),
        ("marker=pytest_garl.MarkerSpec(id=99)", "*found id = 99, expected a whole number*"),
        ("start=pytest_garl.Start(height_m=-1)", "*found height_m = -1, expected*"),
    ],
)
def test_an_invalid_value_shows_the_users_line_and_no_other(
    pytester: pytest.Pytester, argument: str, words: str
) -> None:
    project(pytester)
    tests = pytester.path / "test_it.py"
    text = tests.read_text().replace("maps=", f"{argument}, maps=")
    tests.write_text(f"import pytest_garl\n{text}")
    result = run(pytester)
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["test_it.py:5: in <module>", words])
    for place in ("*pytest_garl/*.py:*", "<string>:*"):
        result.stdout.no_fnmatch_line(place)


def test_a_markers_domain_is_checked_beside_that_of_the_command_line(
    pytester: pytest.Pytester,
) -> None:
    project(pytester, maps="['lawn'], domain='feild'")
    result = run(pytester, "--garl-budget=2", "--garl-domain=calm")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["*mark.garl: domain='feild': *"])


def test_pytest_names_all_arguments_of_the_marker(pytester: pytest.Pytester) -> None:
    output = " ".join(run(pytester, "--markers").stdout.str().split())
    names = "system, maps, domain, marker, start, limits, deterministic, files"
    assert f"@pytest.mark.garl({names}): " in output
