"""What saved cases excuse in a later search, and what they do not."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.regressions.case_file import load_case
from pytest_garl.regressions.corpus import replace_file
from tests.support.case_project import SEARCH, add_cases_to_git, cases, replace_text, run


def _fog(project: pytest.Pytester) -> Path:
    (found,) = [path for path in cases(project) if path.name.startswith("lawn-I-nothing")]
    return found


def test_case_on_an_edge_excuses_no_violation_of_a_search(searched: pytest.Pytester) -> None:
    fog = _fog(searched)
    replace_file(fog, dataclasses.replace(load_case(fog), reason="edge"))
    add_cases_to_git(searched.path)
    result = run(searched, *SEARCH)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert result.parseoutcomes()["failed"] == 1
    result.stdout.fnmatch_lines(["FAILED test_it.py::test_distance[[]lawn-*"])


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
