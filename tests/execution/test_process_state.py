from __future__ import annotations

import random
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.process_state import ProcessState
from pytest_garl.simulation import contacts, loop
from tests.execution.flying import Good, job_of, scenario


@pytest.fixture
def state() -> ProcessState:
    return ProcessState()


@pytest.fixture
def no_alarm() -> Iterator[None]:
    yield
    signal.setitimer(signal.ITIMER_REAL, 0)


def test_imports_and_warning_filters_of_flights_are_no_change(
    state: ProcessState, tmp_path: Path
) -> None:
    from pytest_garl.execution.flight import fly_job

    fly_job(job_of(Good, tmp_path), scenario(), FlightId(search="flight", map="lawn"), None)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "numpy.ndarray size changed")
        random.seed(7)
        assert not state.changed()
    subprocess.Popen([sys.executable, "-c", ""]).wait()
    assert not state.changed()


def limits_nothing(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(contacts, "HARD_TOUCHDOWN_MPS", 100.0)


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


def test_running_timer_is_noticed(state: ProcessState, no_alarm: None) -> None:
    signal.setitimer(signal.ITIMER_REAL, 3600)
    assert state.changed()


def test_running_process_is_noticed(state: ProcessState) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as left:
        assert state.changed()
        left.communicate(b"\n")
