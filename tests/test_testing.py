from __future__ import annotations

import itertools
from typing import Any

import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl import Airframe, Command, Mission, Observation, PositionSetpoint
from pytest_garl.errors import LandingSystemError
from pytest_garl.testing import check_landing_system

COUNTER = itertools.count()


class Climbs:
    needs_camera = False

    def reset(self, mission: Mission) -> None:
        self.height = 3.0

    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=(0.0, -16.5, self.height))


class NoReset:
    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=(0.0, 0.0, 1.0))


class WrongAirframe(Climbs):
    airframe = "big"


class ControlsWithoutRate(Climbs):
    def control(self, state: Any) -> Any:
        return None


class RateWithoutControl(Climbs):
    airframe = Airframe(control_rate_hz=100)


class TakesTwo(Climbs):
    def step(self, observation: Observation, more: int) -> Command:  # type: ignore[override]
        return super().step(observation)


class Scribbles(Climbs):
    def step(self, observation: Observation) -> Command:
        observation.image[0, 0] = 0
        return super().step(observation)


class Whimsical(Climbs):
    def reset(self, mission: Mission) -> None:
        self.height = 2.0 + next(COUNTER)


class Remembers(Climbs):
    def __init__(self) -> None:
        self.height = 2.0

    def reset(self, mission: Mission) -> None:
        self.height += 1.0


class Silent(Climbs):
    def step(self, observation: Observation) -> Any:
        return None


@pytest.mark.parametrize("system", [Climbs, OpenCvLandingSystem])
def test_a_good_system_passes(system: type) -> None:
    check_landing_system(system, seconds=2)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (NoReset, "has no method 'reset'"),
        (WrongAirframe, "airframe is 'big'"),
        (ControlsWithoutRate, "belong together"),
        (RateWithoutControl, "belong together"),
        (TakesTwo, "step: missing a required argument"),
        (Scribbles, "observations are read-only"),
        (Whimsical, "two flights of the same scenario part, first at"),
        (Remembers, "reset\\(mission\\) must forget"),
        (Silent, "step returned None"),
    ],
)
def test_what_is_wrong_is_named(system: type, words: str) -> None:
    with pytest.raises(LandingSystemError, match=words):
        check_landing_system(system, seconds=2)


def test_a_class_inside_a_function_is_refused() -> None:
    class Inner(Climbs):
        pass

    with pytest.raises(LandingSystemError, match="defined inside a function"):
        check_landing_system(Inner)
