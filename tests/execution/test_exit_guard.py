"""A flight in this process cannot end it; children that it forks, and others, end as they like."""

from __future__ import annotations

import contextlib
import os
import posix
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pytest_garl.errors import LandingSystemError
from pytest_garl.execution import exit_guard
from pytest_garl.execution.exit_guard import refusing_end, watched_flight

ORIGINAL = os._exit


@pytest.fixture(autouse=True)
def _uninstalled() -> Iterator[None]:
    yield
    exit_guard.uninstall()
    assert os._exit is posix._exit is ORIGINAL


@pytest.mark.parametrize(
    ("end", "status"),
    [
        (lambda: os._exit(0), 0),
        (lambda: os._exit(86), 86),
        (lambda: os._exit(-1), 255),
        (lambda: os._exit(status=4), 4),
        (lambda: posix._exit(0), 0),
        (lambda: os.execlp("true", "true"), 0),
        (lambda: os.execve("/bin/true", ["true"], {}), 0),
    ],
    ids=["0", "86", "negative", "by name", "posix", "exec", "execve"],
)
def test_the_end_of_the_process_ends_the_flight_and_is_noted(
    end: Callable[[], Any], status: int
) -> None:
    with watched_flight() as watch:
        end()
    assert watch.status == status
    assert "test_exit_guard.py" in watch.stack


def test_a_flight_that_swallows_the_end_is_noted() -> None:
    with watched_flight() as watch, contextlib.suppress(BaseException):
        os._exit(7)
    assert watch.status == 7


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_thread_of_a_flight_ends_nothing() -> None:
    with watched_flight() as watch:
        thread = threading.Thread(target=os._exit, args=(0,))
        thread.start()
        thread.join()
    assert watch.status == 0


def test_a_flight_that_ends_nothing_has_no_status() -> None:
    with watched_flight() as watch:
        pass
    assert watch.status is None
    with pytest.raises(SystemExit), watched_flight():
        sys.exit(0)


def test_a_forked_child_ends_as_it_likes() -> None:
    with watched_flight() as watch:
        child = os.fork()
        if child == 0:
            os._exit(5)
        _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 5
    assert watch.status is None


def _ends_and_goes_on() -> None:
    with contextlib.suppress(SystemExit):
        os._exit(0)
    raise ValueError("it goes on")


@pytest.mark.parametrize("end", [lambda: os._exit(0), _ends_and_goes_on])
def test_a_refused_end_is_an_error_that_names_the_place(end: Callable[[], Any]) -> None:
    words = r"(?s)Lander: tried to end this process, with status 0; .*test_exit_guard\.py"
    with pytest.raises(LandingSystemError, match=words), refusing_end("Lander"):
        end()
    assert os._exit is ORIGINAL


def test_a_refused_end_leaves_all_else_as_it_was() -> None:
    with pytest.raises(ValueError, match="its own"), refusing_end("Lander"):
        raise ValueError("its own")
    exit_guard.install()
    with refusing_end("Lander"):
        pass
    assert os._exit is not ORIGINAL


LATER = """
import os
from pytest_garl.execution.exit_guard import watched_flight
with watched_flight(): pass
os._exit({status})
"""


@pytest.mark.parametrize(("status", "seen"), [(0, 3), (4, 4)])
def test_after_a_flight_no_thread_ends_the_process_with_success(status: int, seen: int) -> None:
    code = LATER.format(status=status)
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == seen
