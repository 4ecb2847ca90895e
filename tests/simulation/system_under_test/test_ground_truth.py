"""Where the marker is, only pilots of this package are told."""

from __future__ import annotations

from typing import Any

import pytest

from pytest_garl.landing_system import Observation, PositionSetpoint
from pytest_garl.simulation.system_under_test.ground_truth import Truth, truth_pilot_of
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.support.answers import flight_of
from tests.support.flights import Scripted

TOLD: list[Any] = []


class Asks(Scripted):
    def observe_truth(self, truth: Truth) -> None:
        TOLD.append(truth)


class Inherits(ReferencePilot):
    def observe_truth(self, truth: Truth) -> None:
        TOLD.append(truth)


class AnswersToEveryName:
    """A proxy, as of a remote object: whatever is asked of it is a function."""

    airframe = Scripted.airframe
    needs_camera = False

    def __getattr__(self, name: str) -> Any:
        return TOLD.append

    def reset(self, mission: object) -> None: ...

    def step(self, observation: Observation) -> PositionSetpoint:
        return PositionSetpoint(position_m=(0.0, 0.0, 3.0))

    def close(self) -> None: ...


@pytest.mark.parametrize("system", [Asks, Inherits, AnswersToEveryName])
def test_landing_system_is_told_nothing(system: type) -> None:
    TOLD.clear()
    assert truth_pilot_of(system()) is None
    flight_of(system)
    assert TOLD == []


def test_pilots_of_the_package_are_told() -> None:
    pilot = ReferencePilot()
    assert truth_pilot_of(pilot) is pilot
