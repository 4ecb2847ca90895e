"""The header forecasts how long a search takes."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project


def test_header_forecasts_the_search_and_each_new_kind(pytester: pytest.Pytester) -> None:
    project(pytester, maps="['lawn', 'court']")
    args = ("--garl-budget=8", "--garl-workers=1", "-k", "test_collisions")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    result.stdout.fnmatch_lines(
        [
            "garl: * 1 worker; about 18 s per system and map, then about 25 s per new kind of *",
            "garl: 2 searches, about 35 s, then about 25 s per new kind of violation",
            "garl: confirming and shrinking 4 new kinds of violation, at most * flights, about * s",
        ]
    )
