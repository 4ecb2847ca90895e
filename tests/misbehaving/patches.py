"""Functions that are replaced, and settings of the whole process that are changed."""

from __future__ import annotations

import builtins
import contextlib
import ctypes
import decimal
import gc
import json
import locale
import math
import os
import random
import socket
import sqlite3
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pybullet

from pytest_garl import landing_system
from pytest_garl.landing_system import Observation
from pytest_garl.simulation import loop, recorder
from tests.misbehaving.base import Harmless, Misbehaves


def _replace(thing: Any, **values: Any) -> None:
    for name, value in values.items():
        setattr(thing, name, value)


def _fail(*arguments: Any, **more: Any) -> Any:
    raise RuntimeError("replaced")


class Patches(Misbehaves):
    """Replaces something; its own flight may end as it likes, but no other may change."""

    comes_to = "either"


class StopsTheClock(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(time, time=lambda: 0.0)


class StopsAllClocks(Patches):
    def misbehave(self, observation: Observation) -> Any:
        names = ("time", "monotonic", "perf_counter", "process_time")
        _replace(time, **dict.fromkeys(names, lambda: 0.0))


class NeverSleeps(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(time, sleep=lambda seconds: None)


class BreaksZeros(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(np, zeros=_fail)


class BendsZeros(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(np, zeros=np.ones)


class BendsRandomness(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(np.random, default_rng=lambda seed=None: np.random.Generator(np.random.MT19937(1)))


class BendsGeometry(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(math, sin=math.cos, cos=math.sin)


class BendsRoots(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(math, sqrt=lambda value: 1.0, hypot=lambda *v: 1.0, dist=lambda a, b: 1.0)


class BreaksJson(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(json, dumps=_fail)


class BreaksOpen(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(builtins, open=_fail)
        _replace(Path, write_bytes=_fail, open=_fail)


class BendsSum(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(builtins, sum=lambda values, start=0: 0.0)


class BreaksTheDatabase(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(sqlite3, connect=_fail)


class BreaksTheLoop(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(loop.Loop, tick=_fail)


class BendsTheLoop(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(loop, PHYSICS_RATE_HZ=100)


class BendsTheRecord(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(recorder.Recorder, contact=lambda *arguments: None)


class BendsCommands(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(landing_system.Land, __init__=lambda self, **fields: None)


class BendsImages(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(cv2, resize=_fail, GaussianBlur=_fail, warpPerspective=_fail)
        cv2.setRNGSeed(1)
        cv2.setNumThreads(8)
        cv2.setUseOptimized(False)


class DisconnectsThePhysics(Patches):
    def misbehave(self, observation: Observation) -> Any:
        for client in range(16):
            with contextlib.suppress(pybullet.error):
                pybullet.disconnect(client)


class ResetsThePhysics(Patches):
    def misbehave(self, observation: Observation) -> Any:
        pybullet.resetSimulation()


class StepsThePhysics(Patches):
    def misbehave(self, observation: Observation) -> Any:
        for client in range(16):
            with contextlib.suppress(pybullet.error):
                pybullet.setGravity(0, 0, 9.81, client)


class RenamesTheProcess(Patches):
    def misbehave(self, observation: Observation) -> Any:
        _replace(os, getpid=lambda: 1, getppid=lambda: 1)


class EmptiesModules(Patches):
    def misbehave(self, observation: Observation) -> Any:
        sys.modules.clear()
        sys.path.clear()


class EmptiesTheEnvironment(Patches):
    def misbehave(self, observation: Observation) -> Any:
        os.environ.clear()


class ClosesStreams(Patches):
    def misbehave(self, observation: Observation) -> Any:
        sys.stdout.close()
        sys.stderr.close()
        sys.stdout = sys.stderr = None


class LowersTheRecursionLimit(Patches):
    def misbehave(self, observation: Observation) -> Any:
        sys.setrecursionlimit(60)


class TracesEverything(Patches):
    def misbehave(self, observation: Observation) -> Any:
        sys.settrace(lambda *arguments: _fail)
        sys.setprofile(lambda *arguments: None)


class TurnsWarningsIntoErrors(Patches):
    def misbehave(self, observation: Observation) -> Any:
        warnings.simplefilter("error")
        np.seterr(all="raise")


class RoundsUpward(Patches):
    """As libraries for intervals do."""

    def misbehave(self, observation: Observation) -> Any:
        ctypes.CDLL(None).fesetround(0x800)


class SeedsEverything(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        random.seed(1)
        np.random.seed(1)  # noqa: NPY002 (as landing systems do)


class ChangesTheProcess(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        os.chdir(tempfile.gettempdir())
        os.umask(0o777)
        os.nice(5)
        gc.disable()
        gc.freeze()
        socket.setdefaulttimeout(0.001)
        decimal.getcontext().prec = 2
        locale.setlocale(locale.LC_ALL, "C")
        sys.setswitchinterval(10.0)


class ChangesEnvironment(Harmless):
    def misbehave(self, observation: Observation) -> Any:
        os.environ.update(OPENBLAS_CORETYPE="Prescott", OMP_NUM_THREADS="7", TZ="Mars/Base")
        time.tzset()
