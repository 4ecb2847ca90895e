from __future__ import annotations

import shutil
import subprocess

import pytest

from pytest_garl.cases.case_file import dump_case, load_case
from pytest_garl.shrinking.shrink import BISECTIONS
from tests.support.case_project import (
    CASES,
    SEARCH,
    USER_PROPERTY_TEST,
    add_cases_to_git,
    cases,
    replace_text,
    run,
    saved,
)
from tests.support.landing_project import project, result_hash


def test_search_saves_small_cases_and_later_runs_expect_them(searched: pytest.Pytester) -> None:
    fog, dog = cases(searched)
    assert (fog.name[:14], dog.name[:11]) == ("lawn-I-nothing", "lawn-IV-dog")
    found = load_case(dog)
    assert set(found.scenario.removed_objects) == {"bird-1", "person-1", "person-2"}
    assert found.scenario["environment.fog"] == 0.0
    assert 0.7 < found.scenario["dog-1.velocity"] < 0.8
    assert load_case(fog).scenario["environment.fog"] < 0.12
    assert load_case(dog).test == "test_it.py::test_collisions"
    assert load_case(fog).test == "test_it.py::test_distance"
    result = run(searched, *CASES, "-rx")
    result.assert_outcomes(passed=2, skipped=2, xfailed=2)
    result.stdout.fnmatch_lines(["*case-lawn-I*known: I:nothing:unseen (scenarios/regressions/*"])
    assert result.ret == 0
    assert not list((searched.path / ".garl").glob("cases-*"))


def test_second_search_expects_saved_cases_and_saves_nothing(searched: pytest.Pytester) -> None:
    before = saved(searched)
    result = run(searched, *SEARCH)
    assert result.ret == 0
    assert "failed" not in result.parseoutcomes()
    assert saved(searched) == before


@pytest.mark.parametrize(
    "how",
    [
        pytest.param(("--garl-workers=1",), marks=pytest.mark.long),
        ("--garl-workers=2", "-n2"),
    ],
)
def test_same_search_saves_the_same_bytes(
    searched: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, how: tuple[str, ...]
) -> None:
    # Nor does the order of sets change them.
    monkeypatch.setenv("PYTHONHASHSEED", "1")
    before, known = saved(searched), result_hash(searched)
    shutil.rmtree(searched.path / "scenarios")
    run(searched, *SEARCH, *how)
    assert saved(searched) == before
    assert result_hash(searched) == known


def test_cases_of_a_search_with_destinations_keep_them(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    run(pytester, *SEARCH, "--garl-method=ga")
    found = [load_case(path) for path in cases(pytester)]
    assert {case.policy for case in found} == {"destination"}
    (dog,) = [case for case in found if case.violation.signature.startswith("IV:dog")]
    assert -1 <= dog.scenario["dog-1.destination_x"] <= 1
    assert not any(key.startswith("person-1") for key, _ in dog.scenario.genes)
    add_cases_to_git(pytester.path)
    run(pytester, *CASES).assert_outcomes(passed=2, skipped=2, xfailed=2)


def test_kind_beyond_the_cap_is_saved_without_shrinking(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", "--garl-workers=0")
    fog, dog = (load_case(path) for path in cases(pytester))
    assert (fog.evidence.neighbours, dog.evidence.neighbours) == (3, 0)
    assert fog.evidence.removed.startswith("4 of 4 objects")
    assert dog.evidence.removed == "nothing"
    result.stdout.fnmatch_lines(
        [
            "*confirming and shrinking 2 new kinds of violation, at most * flights, about * s",
            "*(as the search*",
            "Not shrunk: 1 of 2 causes. By default *",
        ]
    )
    assert "--garl-shrink=12" in result.stdout.str()
    run(pytester, *CASES).assert_outcomes(passed=2, skipped=2, failed=2)


def test_each_new_kind_has_its_own_flights(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", "--garl-workers=0", "--garl-shrink=12")
    assert [load_case(path).evidence.neighbours for path in cases(pytester)] == [3, 3]
    assert "not shrunk" not in result.stdout.str()


def test_exception_takes_at_most_two_flights(pytester: pytest.Pytester) -> None:
    project(pytester, "Raises")
    result = run(pytester, "--garl-budget=4", "--garl-workers=0", "--garl-shrink=100")
    result.stdout.fnmatch_lines(["*1 new kind of violation, at most 2 flights, *"])
    (path,) = cases(pytester)
    assert len(load_case(path).scenario.removed_objects) == 4
    assert "; 1 flight)" in result.stdout.str().replace("\n    ", " ")


@pytest.mark.parametrize("few", ["1", "7"])
def test_too_few_flights_to_shrink_are_refused(pytester: pytest.Pytester, few: str) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", f"--garl-shrink={few}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"*--garl-shrink: found '{few}', expected 0, or at least 8 *"])


def test_zero_flights_switch_shrinking_off(pytester: pytest.Pytester) -> None:
    project(pytester)
    run(pytester, *SEARCH, "--garl-shrink=0")
    assert not cases(pytester)


def test_ci_run_writes_patches_and_leaves_the_tree_unchanged(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", "true")
    project(pytester)
    result = run(pytester, *SEARCH)
    assert not cases(pytester)
    result.stdout.fnmatch_lines(
        ["patch .garl/patches/*.patch", "    git apply *\\", "        .garl/patches/*.patch"]
    )
    patches = sorted((pytester.path / ".garl" / "patches").glob("*.patch"))
    assert len(patches) == 2
    subprocess.run(["git", "init", "-q"], check=True, cwd=pytester.path)
    subprocess.run(["git", "apply", *map(str, patches)], check=True, cwd=pytester.path)
    for path in cases(pytester):
        assert dump_case(load_case(path)) == path.read_text()
    add_cases_to_git(pytester.path)
    assert run(pytester).ret == 0


@pytest.mark.parametrize(
    "how",
    [("--garl-workers=0",), pytest.param(("--garl-workers=1", "-n2"), marks=pytest.mark.long)],
)
def test_own_property_is_shrunk_and_saved_for_its_test(
    pytester: pytest.Pytester, how: tuple[str, ...]
) -> None:
    project(pytester)
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text() + USER_PROPERTY_TEST)
    result = run(pytester, *SEARCH, *how, "--garl-shrink=120")
    result.stdout.fnmatch_lines(["own:test_own:*: a property of your own"])
    (own,) = [path for path in cases(pytester) if "-own-" in path.name]
    case = load_case(own)
    assert (case.test, case.asserting_test) == ("test_it.py::test_own", "test_own")
    assert case.violation.type == "own"
    assert case.violation.description.startswith("test_own: too much snow")
    assert len(case.scenario.removed_objects) == 4
    # As near to 0.1 as the bisections come from at most 0.15.
    assert 0.1 <= case.scenario["environment.snow"] <= 0.1 + 0.15 / 2**BISECTIONS
    add_cases_to_git(pytester.path)
    known = run(pytester)
    # Four tests fly each of the two built-in cases, one flies its own.
    assert sum(known.parseoutcomes().values()) == 4 * 2 + 1
    assert known.ret == 0
    replace_text(tests, "< 0.1,", "< 0.09,")
    assert run(pytester).ret == pytest.ExitCode.TESTS_FAILED


DESCENT = """
    track = Track(
        time_s=np.array([0.0, 9.0, 12.0, 14.2]),
        position_m=np.array([[marker[0] + off, marker[1], z] for z in (0.2, 10.0, 3.0, 1.0)]),
        attitude=np.tile([0.0, 0.0, 0.0, 1.0], (4, 1)),
        velocity_mps=np.zeros((4, 3)),
    )
    flight = dataclasses.replace(flight, uav=track)
    return dataclasses.replace(flight, sha256=hash_of(flight))
"""


@pytest.mark.parametrize("workers", ["0", pytest.param("2", marks=pytest.mark.long)])
def test_what_a_collision_hid_is_flown_again_without_npcs_and_saved(
    pytester: pytest.Pytester, workers: str
) -> None:
    project(pytester)
    simulator = pytester.path / "tiny_simulator.py"
    # A dog hits each flight, so that none lands beside the marker in the fog.
    replace_text(
        simulator, 'scenario.get("dog-1.velocity", 0.0) > 0.7', '"dog-1" in str(scenario.genes)'
    )
    replace_text(
        simulator, "\n    return dataclasses.replace(flight, sha256=hash_of(flight))\n", DESCENT
    )
    search = ("--garl-budget=24", f"--garl-workers={workers}", "--garl-shrink=60")
    result = run(pytester, *search)
    off, dog = (load_case(path) for path in cases(pytester))
    assert dog.violation.signature.startswith("IV:dog:last-metre:")
    assert off.violation.signature == "I:nothing:unseen"
    assert len(off.scenario.removed_objects) == 4
    assert off.scenario["environment.fog"] < 0.12
    output = " ".join(result.stdout.str().split())
    assert "because of off:descending-elsewhere, noted in " in output
    assert "with people, dogs or birds" in output
    before = saved(pytester)
    again = run(pytester, *search)
    again.stdout.fnmatch_lines(["*without people, dogs and birds it fails as I:nothing:unseen*"])
    assert saved(pytester) == before
