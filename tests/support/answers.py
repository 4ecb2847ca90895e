"""Flights of landing systems whose ``step`` returns a given value."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pytest_garl import (
    Detection,
    Diagnostics,
    Land,
    Observation,
)
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, Scripted, nominal

NAN, INF, HUGE = math.nan, math.inf, 10**400


class Answers(Scripted):
    """Its ``step`` returns the result of ``answer``, which a test replaces."""

    answer: Callable[[], Any]

    def step(self, observation: Observation) -> Any:
        return type(self).answer()


def flight_of(system: type, seconds: float = 1.0) -> Any:
    return fly(nominal(), system, STAND, map=EMPTY, time_limit_s=seconds)


def flight_with(answer: Callable[[], Any]) -> Any:
    return flight_of(type("Answers", (Answers,), {"answer": staticmethod(answer)}))


def diagnostics_with_detection(**changes: Any) -> Diagnostics:
    sighting: dict[str, Any] = {
        "marker_id": 0,
        "confidence": 1.0,
        "position_m": (0.0, 0.0, 0.0),
    } | changes
    return Diagnostics(detections=(Detection(**sighting),))


def land_with(**diagnostics: Any) -> Land:
    return Land(diagnostics=Diagnostics(**diagnostics))
