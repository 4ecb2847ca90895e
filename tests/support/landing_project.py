"""A project with landing tests and a very fast simulator, for tests that run pytest."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger

SYSTEMS = """
import os, time, math
from pytest_garl import Land, VelocitySetpoint

class Good:
    def reset(self, mission): pass
    def step(self, observation): return Land()

class Raises(Good):
    def step(self, observation): raise ZeroDivisionError("no plan")

class Exits(Good):
    def step(self, observation): os._exit(3)

class Sleeps(Good):
    def step(self, observation): time.sleep(60)

class NoStep:
    def reset(self, mission): pass
"""


CONFTEST = """
import tiny_simulator
def pytest_garl_fly(config):
    return tiny_simulator.fly
"""


TESTS = """
import pytest
from systems import *
pytestmark = pytest.mark.garl(system={system}, maps={maps})

def test_distance(landing):
    assert landing.distance_to_landing_m <= 1.5

def test_time(landing):
    assert landing.time_to_landing_s <= 120

def test_collisions(landing):
    assert not landing.collisions
"""


INI = "[pytest]\ngarl_domain = paper\n"
"""What the tiny simulator knows of conditions, fog and a dog, no sparse scenario lacks."""


def write_project(folder: Path, system: str = "Good", maps: str = "['lawn']") -> None:
    shutil.copy(Path(__file__).with_name("tiny_simulator.py"), folder)
    (folder / "systems.py").write_text(SYSTEMS)
    (folder / "test_it.py").write_text(TESTS.format(system=system, maps=maps))
    (folder / "conftest.py").write_text(CONFTEST)
    (folder / "pytest.ini").write_text(INI)


def project(pytester: pytest.Pytester, system: str = "Good", maps: str = "['lawn']") -> None:
    write_project(pytester.path, system, maps)


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    """Run pytest; a search saves no cases unless the arguments have ``--garl-shrink``."""
    searches = any(arg.startswith("--garl-budget") for arg in args)
    save_no_cases = ("--garl-shrink=0",) if searches else ()
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *save_no_cases, *args)


def result_hash(pytester: pytest.Pytester) -> str:
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    try:
        return ledger.queries.result_hash()
    finally:
        ledger.close()
