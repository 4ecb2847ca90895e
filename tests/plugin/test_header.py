"""The header forecasts how long a search takes."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project


def test_header_forecasts_search_and_shrinking(pytester: pytest.Pytester) -> None:
    project(pytester, maps="['lawn', 'court']")
    args = ("--garl-budget=8", "--garl-workers=1", "-k", "test_collisions")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    result.stdout.fnmatch_lines(
        [
            "garl: * 1 worker; 17 s to 50 s per system and map, shrinking included",
            "garl: 2 searches, 34 s to 2 min, shrinking included",
            "garl: confirming and shrinking 3 new kinds of violation*, at most * flight*, about *s",
        ]
    )


def test_header_says_that_each_kind_takes_one_worker(pytester: pytest.Pytester) -> None:
    project(pytester)
    args = ("--garl-budget=2", "--garl-workers=2", "-k", "test_time", "--garl-shrink=12")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    result.stdout.fnmatch_lines(["*, and 15 s to 44 s per new kind of violation, on one worker"])


@pytest.mark.parametrize(
    ("shrink", "words"), [("12", ", and 15 s to 44 s per new kind of violation"), ("0", "")]
)
def test_header_forecasts_each_kind_if_there_is_no_cap(
    pytester: pytest.Pytester, shrink: str, words: str
) -> None:
    project(pytester)
    args = ("--garl-budget=8", "--garl-workers=1", "-k", "test_time", f"--garl-shrink={shrink}")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    result.stdout.fnmatch_lines([f"garl: * 1 worker; 10 s to 31 s per system and map{words}"])
