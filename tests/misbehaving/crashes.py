"""Exceptions of every kind, and processes that end."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from typing import Any

import numpy as np

from pytest_garl.landing_system import Airframe, Mission, Observation, VehicleState
from tests.misbehaving.base import Lander, Misbehaves


class RaisesInInit(Lander):
    def __init__(self) -> None:
        raise ValueError("no start")


class RaisesInReset(Lander):
    def reset(self, mission: Mission) -> None:
        raise FileNotFoundError("weights.npz")


class RaisesInStep(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise ZeroDivisionError("no plan")


class RaisesInControl(Lander):
    airframe = Airframe(latency_s=0.0, control_rate_hz=240)

    def control(self, state: VehicleState) -> Any:
        raise IndexError("no motor")


class SilentError(Exception):
    def __str__(self) -> str:
        raise RuntimeError("no text")


class RaisesWithoutText(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise SilentError


class RaisesAFlood(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise ValueError("x" * 50_000_000)


LongError = type("L" * 400, (Exception,), {})
PathError = type("../../etc", (Exception,), {})


class RaisesWithALongName(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise LongError


class RaisesWithAPathForAName(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise PathError


class RaisesNotes(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        error = ValueError("noted")
        error.__notes__ = 5  # type: ignore[assignment]
        raise error


class RaisesEscapes(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise ValueError("\x1b[2J\x1b]0;owned\x07 \u202e \ud800 \0")


class RaisesAGroup(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise ExceptionGroup("many", [ValueError("one")] * 10_000)


class RaisesALongChain(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        error = ValueError("first")
        for _ in range(5_000):
            after = ValueError("next")
            after.__cause__, error = error, after
        raise error


class OwnBaseError(BaseException):
    pass


class RaisesNoException(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise OwnBaseError("not an Exception")


class RaisesStopIteration(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return next(iter(()))


class RaisesGeneratorExit(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise GeneratorExit


class InterruptsItself(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        raise KeyboardInterrupt


class RecursesForEver(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return self.misbehave(observation)


class AsksForTooMuchMemory(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        return np.empty(2**50, np.uint8)


class WritesIntoTheObservation(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        observation.depth_m[:] = 0


class UnlocksTheObservation(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        observation.depth_m.flags.writeable = True
        observation.depth_m[:] = 99


class AsksTheTerminal(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        input("Land? ")


class Exits(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        sys.exit()


class ExitsWithWords(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        sys.exit("garl cannot go on: the landing system says so")


class ExitsAtOnce(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        os._exit(0)


class ExitsWithStatus(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        os._exit(86)


class SpeaksForThePool(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        sys.stderr.write("garl cannot go on: the disk is full\n")
        sys.stderr.flush()
        os._exit(1)


class SpeaksForThePython(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        sys.stderr.write("Traceback (most recent call last):\nMemoryError\n")
        sys.stderr.flush()
        os._exit(1)


class Aborts(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        os.abort()


class SegmentationFault(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        ctypes.string_at(0)


class KillsItself(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        os.kill(os.getpid(), signal.SIGKILL)


class TerminatesItself(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        os.kill(os.getpid(), signal.SIGTERM)


class KillsItsGroup(Misbehaves):
    def misbehave(self, observation: Observation) -> Any:
        os.killpg(0, signal.SIGKILL)
