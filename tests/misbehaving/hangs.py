"""Calls that never return, and floods of output."""

from __future__ import annotations

import faulthandler
import logging
import os
import re
import signal
import socket
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from typing import Any

from pytest_garl.landing_system import Mission, Observation, PositionSetpoint
from tests.misbehaving.base import Harmless, Lander, Misbehaves

LONG_S = 600.0
FLOOD_BYTES = 200_000_000


def hold_the_interpreter() -> None:
    """Spend a life in C code that never lets another thread run."""
    re.match(r"(a+)+$", "a" * 60 + "b")


class SleepsInInit(Lander):
    def __init__(self) -> None:
        time.sleep(LONG_S)


class SleepsInReset(Lander):
    def reset(self, mission: Mission) -> None:
        time.sleep(LONG_S)


class Sleeps(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        time.sleep(LONG_S)


class Spins(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        while True:
            pass


class HoldsTheInterpreter(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        hold_the_interpreter()


class HoldsTheInterpreterFromAThread(Misbehaves):
    """The thread goes on when the call has returned."""

    def misbehave(self, observation: Observation) -> Any:
        threading.Thread(target=hold_the_interpreter, daemon=True).start()


class CatchesEverything(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        while True:
            try:
                time.sleep(LONG_S)
            except BaseException:  # noqa: BLE001 (that is its fault)
                continue


class Deadlocks(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        lock = threading.Lock()
        lock.acquire()
        lock.acquire()


class WaitsForACall(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        with socket.socket() as server:
            server.bind(("127.0.0.1", 0))
            server.listen()
            server.accept()


class SlowError(Exception):
    def __str__(self) -> str:
        time.sleep(LONG_S)
        return ""


class RaisesWhatHangs(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise SlowError


def _slowly() -> Iterator[float]:
    time.sleep(LONG_S)
    yield 0.0


class ReturnsWhatHangs(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return PositionSetpoint(position_m=_slowly())  # type: ignore[arg-type]


class EndsTheWatch(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        faulthandler.cancel_dump_traceback_later()
        faulthandler.disable()
        time.sleep(LONG_S)


class IgnoresSignals(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        for number in set(signal.Signals) - {signal.SIGKILL, signal.SIGSTOP}:
            signal.signal(number, signal.SIG_IGN)
        time.sleep(LONG_S)


class StopsItself(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        os.kill(os.getpid(), signal.SIGSTOP)


class FloodsStdout(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        for _ in range(FLOOD_BYTES // 10**6):
            sys.stdout.write("x" * 10**6)


class FloodsStderr(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        for _ in range(FLOOD_BYTES // 10**6):
            sys.stderr.write("x" * 10**6)


class FloodsTheDescriptor(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        for _ in range(FLOOD_BYTES // 10**6):
            os.write(2, b"\n" * 10**6)


class FloodsTheLog(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        for index in range(20_000):
            logging.getLogger("landing").critical("frame %d is bad", index)


class FloodsWithWarnings(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        warnings.simplefilter("always")
        for index in range(20_000):
            warnings.warn(f"frame {index} is bad", stacklevel=1)


class WritesEscapes(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        sys.stderr.write("\x1b[2J\x1b]0;owned\x07" * 1_000)
