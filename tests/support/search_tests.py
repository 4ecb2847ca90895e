"""Tests of a landing, as a user writes them, for sessions whose items fail or are excused."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project


def write_tests(pytester: pytest.Pytester, system: str, tests: str) -> None:
    project(pytester, system)
    head = (
        "import pytest\nfrom systems import *\n"
        f"pytestmark = pytest.mark.garl(system={system}, maps=['lawn'])\n"
    )
    (pytester.path / "test_it.py").write_text(head + tests)


COLLISIONS = "\ndef test_collisions(landing):\n    assert not landing.collisions\n"
DISTANCE = "\ndef test_distance(landing):\n    assert landing.distance_to_landing_m <= 1.5\n"
HIT = "collided with dog-1 at 1.0 m/s, 0.0 m up, 3.0 m east of the marker"
"""The headline of the dog in the tiny simulator."""
SEARCH_ALL = ("--garl-budget=24", "--garl-workers=0", "-rfx")


def outcomes_of(result: pytest.RunResult, word: str) -> set[str]:
    """Return the ids of the items of which the short summary says so."""
    lines = [line for line in result.outlines if line.startswith(f"{word} ")]
    return {line.removeprefix(f"{word} ").split(" - ")[0] for line in lines}


SIMULATOR = """
import dataclasses
import tiny_simulator
from pytest_garl.flight.flight import Contact

def fly(scenario, *args, **kwargs):
    flight = tiny_simulator.fly(scenario, *args, **kwargs)
    return {change} if {when} else flight
"""


def write_simulator(pytester: pytest.Pytester, change: str, when: str) -> None:
    (pytester.path / "simulator.py").write_text(SIMULATOR.format(change=change, when=when))
    pytester.makeconftest("import simulator\ndef pytest_garl_fly(config): return simulator.fly\n")
