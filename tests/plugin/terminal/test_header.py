"""The header forecasts how long a search takes."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project

NEXT = "; the time left follows after 20 flights"


TIMED = """
import dataclasses, time
import tiny_simulator

def fly(*args, **named):
    began = time.perf_counter()
    flight = tiny_simulator.fly(*args, **named)
    time.sleep({seconds})
    return dataclasses.replace(flight, wall_s=time.perf_counter() - began)
"""
"""A simulator whose flights last that long, and say so."""


def timed(pytester: pytest.Pytester, seconds: float, maps: str = "['lawn']") -> None:
    """Write a project whose flights last as long as this."""
    project(pytester, maps=maps)
    pytester.makepyfile(timed=TIMED.format(seconds=seconds))
    pytester.makeconftest("import timed\ndef pytest_garl_fly(config):\n    return timed.fly\n")


def test_header_says_where_it_flies_if_pytest_itself_cannot(pytester: pytest.Pytester) -> None:
    """A library that another plugin has loaded keeps pytest from flying itself."""
    project(pytester)
    (pytester.path / "early.py").write_text("import numpy\n")
    result = pytester.runpytest_subprocess("-p", "early", "--garl-budget=1", "--garl-workers=0")
    inside = "flown in a worker process, not inside pytest" not in result.stdout.str()
    expected = "flown inside pytest" if inside else "1 worker"
    result.stdout.fnmatch_lines([f"garl: budget 1 * {expected}*"])


def test_first_run_tells_the_time_when_it_knows_it(pytester: pytest.Pytester) -> None:
    timed(pytester, 0.05, "['lawn', 'court']")
    args = ("--garl-budget=24", "--garl-workers=1", "-k", "test_collisions")
    first = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    first.stdout.fnmatch_lines(
        [
            f"garl: * 1 worker{NEXT}",
            "garl: about * s left, shrinking included",
            "garl: confirming and shrinking * new kinds of violation*, at most * flight*, about *s",
        ]
    )
    first.stdout.no_fnmatch_line("garl: 2 searches*")
    # The next run in the folder knows how long a flight takes.
    again = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args, "--garl-shrink=0")
    again.stdout.fnmatch_lines(
        ["garl: * 1 worker; about ? s per system and map", "garl: 2 searches, about ? s"]
    )
    again.stdout.no_fnmatch_line("garl: about * left*")


@pytest.mark.parametrize(
    ("workers", "shrink", "words"),
    [
        ("1", "12", ", and about ? s per new kind of violation"),
        ("2", "12", ", and about ? s per new kind of violation, on one worker"),
        ("1", "0", ""),
    ],
)
def test_header_forecasts_each_kind_if_there_is_no_cap(
    pytester: pytest.Pytester, workers: str, shrink: str, words: str
) -> None:
    timed(pytester, 0.05)
    args = ("--garl-budget=8", f"--garl-workers={workers}", "-k", "test_time")
    for each in ("0", shrink):
        result = pytester.runpytest_subprocess(
            "-p", "no:cacheprovider", *args, f"--garl-shrink={each}"
        )
    plural = "s" if workers == "2" else ""
    result.stdout.fnmatch_lines(
        [f"garl: * {workers} worker{plural}; about ? s per system and map{words}"]
    )


def test_search_that_is_over_so_soon_promises_no_time(pytester: pytest.Pytester) -> None:
    project(pytester)
    args = ("--garl-budget=8", "--garl-workers=1", "--garl-shrink=0", "-k", "test_time")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    result.stdout.fnmatch_lines(["garl: * 1 worker"])
