"""What saved cases excuse in a later search, and what they do not."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.cases.case import Worst
from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import replace_file
from pytest_garl.cases.shrunk_cause import cause_of_case
from tests.support.case_project import SEARCH, add_cases_to_git, cases, replace_text, run, saved
from tests.support.landing_project import project


def _fog(project: pytest.Pytester) -> Path:
    (found,) = [path for path in cases(project) if path.name.startswith("lawn-I-nothing")]
    return found


def test_case_on_an_edge_excuses_no_violation_of_a_search(searched: pytest.Pytester) -> None:
    fog = _fog(searched)
    edge = replace_file(fog, dataclasses.replace(load_case(fog), reason="edge"))
    add_cases_to_git(searched.path)
    result = run(searched, *SEARCH)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert result.parseoutcomes()["failed"] == 1
    result.stdout.fnmatch_lines(["FAILED test_it.py::test_distance[[]lawn-*"])
    # A robust case of the kind is saved beside it.
    assert edge.exists()
    assert fog.exists()
    assert load_case(fog).gates


def test_cases_that_gate_nothing_can_be_left_out_by_their_mark(searched: pytest.Pytester) -> None:
    fog = _fog(searched)
    replace_file(fog, dataclasses.replace(load_case(fog), reason="edge"))
    listed = ("--collect-only", "-q", "-k", "lawn-I-nothing")
    chosen = run(searched, *listed, "-m", "garl_gates_nothing")
    others = run(searched, "--collect-only", "-q", "-m", "not garl_gates_nothing")
    assert "case-lawn-I-nothing" in chosen.stdout.str()
    assert "case-lawn-I-nothing" not in others.stdout.str()
    assert "case-" in others.stdout.str()
    result = run(searched, "--garl-workers=0", "-m", "not garl_gates_nothing", "-k", "test_time")
    assert result.ret == pytest.ExitCode.OK


def test_known_case_is_red_in_no_session_whose_tests_do_not_assert_it(
    searched: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", "true")
    result = run(searched, "--garl-workers=0", "-k", "test_time")
    assert result.ret == pytest.ExitCode.OK
    result.assert_outcomes(passed=1, skipped=1, deselected=4)
    result.stdout.no_fnmatch_line("*no selected test fails*")
    (path,) = [each for each in cases(searched) if each.name.startswith("lawn-I-nothing")]
    replace_text(path, 'status = "open"', 'status = "fixed"')
    result = run(searched, "--garl-workers=0", "-k", "test_time")
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_search_in_which_no_flight_lands_is_red_although_all_is_known(
    searched: pytest.Pytester,
) -> None:
    # Each flight is hit by a dog, and that is known.
    replace_text(
        searched.path / "tiny_simulator.py",
        'scenario.get("dog-1.velocity", 0.0) > 0.7',
        '"dog-1" in str(scenario.genes)',
    )
    result = run(searched, *SEARCH)
    assert "failed" not in result.parseoutcomes()
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(
        [
            "*garl: this run is not green*",
            "Good on lawn: landed within the limits in none of 24 flights, so*",
        ]
    )


def _break(project: pytest.Pytester, old: str, new: str) -> None:
    """Change the simulator, and so what the landing system does in it."""
    replace_text(project.path / "tiny_simulator.py", old, new)


OFF = 'off = 3.0 if scenario["environment.fog"] > 0.1 and not knows else 0.1'


def test_case_holds_the_worst_violation_of_its_search(searched: pytest.Pytester) -> None:
    fog = load_case(_fog(searched))
    assert fog.worst == Worst(margin=0.75 - 3.0)
    (dog,) = [load_case(path) for path in cases(searched) if "-IV-dog-" in path.name]
    assert dog.worst is not None
    assert dog.worst.grade == "hostile"


@pytest.mark.parametrize(
    "how",
    [
        ("--garl-workers=0",),
        pytest.param(("--garl-workers=2", "-n2"), marks=pytest.mark.long),
    ],
)
def test_known_case_excuses_no_worse_violation(
    searched: pytest.Pytester, how: tuple[str, ...]
) -> None:
    _break(searched, OFF, OFF.replace("3.0", "4.0"))
    before = saved(searched)
    result = run(searched, "--garl-budget=24", "--garl-shrink=60", *how)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert result.parseoutcomes()["failed"] == 1
    output = " ".join(result.stdout.str().split())
    assert "A known case ends alike and does not excuse it (lawn-I-nothing-" in output
    assert "its margin is -3.25, the worst known is -2.25." in output
    (new,) = saved(searched).keys() - before.keys()
    assert load_case(searched.path / "scenarios/regressions/systems" / new).worst == Worst(
        margin=0.75 - 4.0
    )
    add_cases_to_git(searched.path)
    assert run(searched, *SEARCH).ret == pytest.ExitCode.OK


def test_twin_without_the_known_cause_shows_another_one(searched: pytest.Pytester) -> None:
    # In the search many conditions act at once: only the twin tells rain from fog.
    _break(searched, OFF, OFF.replace("environment.fog", "environment.rain"))
    result = run(searched, *SEARCH)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert result.parseoutcomes()["failed"] == 1
    output = " ".join(result.stdout.str().split())
    assert "first violation of the kind fails without fog too" in output
    causes = [cause_of_case(load_case(path)).text for path in cases(searched) if "-I-" in path.name]
    assert sorted(causes) == ["fog", "rain"]
    add_cases_to_git(searched.path)
    again = run(searched, *SEARCH)
    assert again.ret == pytest.ExitCode.OK, again.stdout.str()


def test_two_causes_of_one_ending_are_two_cases_of_one_search(pytester: pytest.Pytester) -> None:
    project(pytester)
    both = 'max(scenario["environment.fog"], scenario["environment.rain"])'
    _break(pytester, OFF, OFF.replace('scenario["environment.fog"]', both))
    run(pytester, *SEARCH)
    found = [load_case(path) for path in cases(pytester)]
    causes = [cause_of_case(case).text for case in found if case.ending == "I:nothing:unseen"]
    assert sorted(causes) == ["fog", "rain"]
    add_cases_to_git(pytester.path)
    again = run(pytester, *SEARCH)
    assert again.ret == pytest.ExitCode.OK, again.stdout.str()
    assert [load_case(path) for path in cases(pytester)] == found
