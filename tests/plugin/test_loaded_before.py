"""Flights inside pytest use the baseline kernels; if it is too late for that, a worker flies."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from pytest_garl import cpu_dispatch
from tests.support.landing_project import TESTS, result_hash, run, write_project

SYSTEM = """
import os
from pathlib import Path
from pytest_garl import cpu_dispatch
from pytest_garl import Land

class Tells:
    def reset(self, mission): pass
    def step(self, observation):
        Path("in_system.txt").write_text(f"{os.getpid()} {cpu_dispatch.dispatched()}")
        return Land()
"""
CONFTEST = """
import os
from pathlib import Path
import numpy
import tiny_simulator
from pytest_garl import cpu_dispatch
Path("in_pytest.txt").write_text(f"{os.getpid()} {cpu_dispatch.dispatched()}")
def pytest_garl_fly(config):
    return tiny_simulator.fly
"""
pytestmark = pytest.mark.skipif(not cpu_dispatch.has_baseline(), reason="this CPU has no AVX2")


@pytest.fixture
def unpinned(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """Return a project whose conftest.py loads NumPy, and an environment that misleads it."""
    write_project(pytester.path)
    (pytester.path / "systems.py").write_text(SYSTEM)
    (pytester.path / "test_it.py").write_text(TESTS.format(system="Tells", maps="['lawn']"))
    (pytester.path / "conftest.py").write_text(CONFTEST)
    for name in cpu_dispatch.environment():
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Nehalem")
    return pytester


def flown(pytester: pytest.Pytester, *args: str) -> tuple[pytest.RunResult, list[str], list[str]]:
    """Return what pytest and the landing system say of themselves: process, instructions."""
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", "--garl-shrink=0", *args)
    in_pytest, in_system = (
        Path(pytester.path / name).read_text() for name in ("in_pytest.txt", "in_system.txt")
    )
    return result, in_pytest.split(), in_system.split()


@pytest.mark.parametrize(
    "args", [("--garl-workers=0", "--garl-budget=1"), ("-o", "garl_workers=0", "--garl-budget=1")]
)
def test_conftest_loads_numpy_after_the_choice_of_instructions(
    unpinned: pytest.Pytester, args: tuple[str, ...]
) -> None:
    result, in_pytest, in_system = flown(unpinned, *args)
    assert in_system == in_pytest
    assert in_system[1] == cpu_dispatch.BASELINE
    result.stdout.no_fnmatch_line("*loaded before*")


def test_search_is_bred_with_baseline_instructions(unpinned: pytest.Pytester) -> None:
    _, in_pytest, in_system = flown(unpinned, "--garl-workers=1", "--garl-budget=1")
    assert in_pytest[1] == in_system[1] == cpu_dispatch.BASELINE
    assert in_pytest[0] != in_system[0]


def test_environment_does_not_change_what_a_search_breeds(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The method ga raises numbers to powers, which NumPy does otherwise by AVX-512 or SSE."""
    write_project(pytester.path)
    found = set()
    for setting in ({}, {"NPY_DISABLE_CPU_FEATURES": "X86_V3", "OPENBLAS_CORETYPE": "Nehalem"}):
        with monkeypatch.context() as outside:
            for name in cpu_dispatch.environment():
                outside.delenv(name, raising=False)
            for name, value in setting.items():
                outside.setenv(name, value)
            run(pytester, "--garl-budget=16", "--garl-method=ga", "--garl-workers=1")
        found.add(result_hash(pytester))
    assert len(found) == 1


def test_other_sessions_keep_their_instructions(unpinned: pytest.Pytester) -> None:
    unpinned.runpytest_subprocess("-p", "no:cacheprovider", "-o", "garl_workers=1")
    assert (unpinned.path / "in_pytest.txt").read_text().endswith("-nehalem")


def test_numpy_loaded_early_sends_flights_to_a_worker(unpinned: pytest.Pytester) -> None:
    unpinned.makepyfile(early="import numpy")
    unpinned.syspathinsert()
    result, in_pytest, in_system = flown(
        unpinned, "-p", "early", "--garl-workers=0", "--garl-budget=1"
    )
    assert in_pytest[1].endswith("-nehalem")
    assert in_system[1] == cpu_dispatch.BASELINE
    assert in_pytest[0] != in_system[0]
    result.stdout.fnmatch_lines(
        ["garl: loaded before*kernels for nehalem*flown in a worker process, not inside pytest"]
    )


def test_command_restarts_if_numpy_was_loaded_first(
    unpinned: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by a .pth file or sitecustomize.py."""
    customs = unpinned.mkdir("customs")
    (customs / "sitecustomize.py").write_text("import numpy")
    paths = [str(customs), *filter(None, [os.environ.get("PYTHONPATH")])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    code = (
        "import sys, numpy\n"
        "from pytest_garl import cpu_dispatch\n"
        "from pytest_garl.cli import main\n"
        "sys.argv = ['garl', '--version']\n"
        "print('began')\n"
        "try:\n    main()\n"
        "finally:\n    print(cpu_dispatch.dispatched())\n"
    )
    result = unpinned.run(sys.executable, "-u", "-c", code)
    assert result.outlines.count("began") == 2
    assert result.outlines[-1] == cpu_dispatch.BASELINE


CHECKED = """
import numpy, os
from pathlib import Path
from pytest_garl import cpu_dispatch
from pytest_garl import Land, VelocitySetpoint
from pytest_garl.testing import check_landing_system

class Good:
    def reset(self, mission): pass
    def step(self, observation):
        Path("in_system.txt").write_text(cpu_dispatch.dispatched())
        return Land()

class Wrong(Good):
    def step(self, observation): return "down"

if __name__ == "__main__":
    print(cpu_dispatch.dispatched())
    print(check_landing_system(Good, seconds=2.0).flights)
    try:
        check_landing_system(Wrong, seconds=2.0)
    except Exception as error:
        print(type(error).__name__, error)
"""


@pytest.mark.sim
def test_checker_flies_in_a_worker_if_numpy_was_loaded_first(
    unpinned: pytest.Pytester,
) -> None:
    script = unpinned.makepyfile(checked=CHECKED)
    result = unpinned.run(sys.executable, script)
    result.stdout.fnmatch_lines(["*-nehalem", "*lawn*", "LandingSystemError *down*"])
    assert (unpinned.path / "in_system.txt").read_text() == cpu_dispatch.BASELINE
    assert result.ret == 0
