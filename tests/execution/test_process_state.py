from __future__ import annotations

import ctypes
import platform
import random
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from multiprocessing import resource_tracker
from pathlib import Path

import cv2
import numpy as np
import pytest

from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.process_state import ProcessState
from pytest_garl.execution.reference import reference_to
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.simulation import contacts, loop
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from pytest_garl.verdicts.verdict import Limits
from tests.execution.flying import LAWN, Good, job_of, scenario
from tests.support.engines import engine

__all__ = ["engine"]


@pytest.fixture
def state() -> ProcessState:
    # PyTorch, which tests of training load, starts a process that outlives them.
    resource_tracker._resource_tracker._stop()  # type: ignore[attr-defined]
    return ProcessState()


@pytest.fixture
def no_alarm() -> Iterator[None]:
    yield
    signal.setitimer(signal.ITIMER_REAL, 0)


def test_imports_and_warning_filters_of_flights_are_no_change(
    state: ProcessState, tmp_path: Path
) -> None:
    from pytest_garl.execution.fly_and_judge import fly_job

    fly_job(job_of(Good, tmp_path), scenario(), FlightId(search="flight", map="lawn"), None)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "numpy.ndarray size changed")
        random.seed(7)
        assert not state.changed()
    subprocess.Popen([sys.executable, "-c", ""]).wait()
    assert not state.changed()


def limits_nothing(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(contacts, "ABORT_HEIGHT_M", 100.0)


def never_ends(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(loop.Loop, "tick", lambda self: None)


def no_zeros(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(np, "zeros", np.ones)


def another_module(patch: pytest.MonkeyPatch) -> None:
    patch.setitem(sys.modules, "cv2", np)


def another_folder(patch: pytest.MonkeyPatch) -> None:
    patch.chdir("/")


def another_built_in(patch: pytest.MonkeyPatch) -> None:
    patch.setattr("builtins.min", max)


@pytest.mark.parametrize(
    "change",
    [limits_nothing, never_ends, no_zeros, another_module, another_folder, another_built_in],
)
def test_change_that_another_flight_would_meet_is_noticed(
    state: ProcessState, change: Callable[[pytest.MonkeyPatch], None]
) -> None:
    assert not state.changed()
    with pytest.MonkeyPatch.context() as patch:
        change(patch)
        assert state.changed()
    assert not state.changed()


def test_changed_settings_of_libraries_are_noticed(state: ProcessState) -> None:
    with np.errstate(all="raise"):
        assert state.changed()
    optimized = cv2.useOptimized()
    cv2.setUseOptimized(not optimized)
    assert state.changed()
    cv2.setUseOptimized(optimized)
    assert not state.changed()


def set_mxcsr(bits: int) -> None:
    """Set the control word of SSE alone, as the intrinsics of a C compiler do."""
    library = ctypes.CDLL(None)
    environment = ctypes.create_string_buffer(64)
    library.fegetenv(environment)
    ctypes.memmove(ctypes.addressof(environment) + 28, bits.to_bytes(4, "little"), 4)
    library.fesetenv(environment)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="constants of x86-64")
def test_rounding_mode_is_noticed(state: ProcessState) -> None:
    library = ctypes.CDLL(None)
    upward, nearest = 0x800, 0
    try:
        assert library.fesetround(upward) == 0
        assert state.changed()
        library.fesetround(nearest)
        assert not state.changed()
        default, all_downward = 0x1F80, 0x1F80 | 0x2000
        set_mxcsr(all_downward)
        assert library.fegetround() == nearest
        assert state.changed()
        set_mxcsr(default)
    finally:
        library.fesetround(nearest)
    # What has occurred is no setting.
    assert 1.0 / 3.0 > 0
    assert not state.changed()


def test_running_timer_is_noticed(state: ProcessState, no_alarm: None) -> None:
    signal.setitimer(signal.ITIMER_REAL, 3600)
    assert state.changed()


def test_running_process_is_noticed(state: ProcessState) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as left:
        assert state.changed()
        left.communicate(b"\n")


@pytest.mark.usefixtures("engine")
def test_flight_imports_no_module_of_this_package_after_the_state_is_taken(tmp_path: Path) -> None:
    """A landing system could replace functions of such a module, and nobody would notice."""
    job = FlightJob.for_system(
        reference_to(ReferencePilot),
        LAWN,
        policy_spec("dqn"),
        flights=tmp_path,
        limits=Limits(time_s=3.0),
        path=(),
    )
    code = (
        "import sys\n"
        "from pytest_garl.execution import process_state, worker\n"
        "process_state.ProcessState()\n"
        "before = {*sys.modules}\n"
        "from pytest_garl.execution.fly_and_judge import fly_job\n"
        "from pytest_garl.execution.flight_id import FlightId\n"
        "from pytest_garl.execution.job import parse_job\n"
        "from pytest_garl.scenarios.files import parse_scenario\n"
        "job, scenario = parse_job(sys.argv[1]), parse_scenario(sys.argv[2])\n"
        "fly_job(job, scenario, FlightId(search='flight', map='lawn'), None)\n"
        "print(sorted(name for name in {*sys.modules} - before if 'pytest_garl' in name))\n"
    )
    command = [sys.executable, "-c", code, job.dumps(), dump_scenario(scenario())]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
