"""A landing system is closed once after its flight."""

from __future__ import annotations

from typing import ClassVar

import pytest

from pytest_garl import Abort, Command, Land, Mission, Observation
from pytest_garl.errors import LandingSystemError
from pytest_garl.simulation.fly import fly
from pytest_garl.testing import check_landing_system
from tests.support.flights import EMPTY, STAND, Falls, Hovers, Scripted, nominal


class Closes(Scripted):
    calls: ClassVar[list[str]] = []

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.calls.append("reset")

    def step(self, observation: Observation) -> Command:
        return self.hover(2.0) if observation.time_s < 3 else Land()

    def close(self) -> None:
        self.calls.append("close")


class GivesUp(Closes):
    def step(self, observation: Observation) -> Command:
        return Abort()


class Raises(Closes):
    def step(self, observation: Observation) -> Command:
        raise ZeroDivisionError("no plan")


@pytest.mark.parametrize(
    ("system", "outcome"), [(Closes, "landed"), (GivesUp, "gave_up"), (Raises, "crashed")]
)
def test_a_system_is_closed_once_however_the_flight_ends(system: type, outcome: str) -> None:
    Closes.calls.clear()
    flight = fly(nominal(), system, STAND, map=EMPTY, time_limit_s=20)
    assert flight.outcome == outcome
    assert Closes.calls == ["reset", "close"]


class _RaisesInClose:
    def close(self) -> None:
        raise OSError("the port is gone")


class LandsThenRaises(_RaisesInClose, Closes):
    pass


class FallsThenRaises(_RaisesInClose, Falls):
    pass


def test_an_error_of_close_fails_a_flight_that_had_landed() -> None:
    flight = fly(nominal(), LandsThenRaises, STAND, map=EMPTY, time_limit_s=20)
    assert flight.outcome == "crashed"
    assert flight.crash is not None
    assert (flight.crash.error, flight.crash.message) == ("OSError", "the port is gone")
    assert flight.touchdown is not None


def test_an_error_of_close_hides_no_collision() -> None:
    flight = fly(nominal(), FallsThenRaises, STAND, map=EMPTY, time_limit_s=20)
    assert flight.outcome == "collision"
    assert flight.crash is None
    assert [event.name for event in flight.events][-1] == "close_failed"


class CannotFlyClosed(Hovers):
    """Is broken for ever once it is closed, and counts who was not closed."""

    open: ClassVar[list[object]] = []

    def __init__(self) -> None:
        self.open.append(self)

    def step(self, observation: Observation) -> Command:
        if self not in self.open:
            raise RuntimeError("closed")
        return super().step(observation)

    def close(self) -> None:
        self.open.remove(self)


def test_the_check_closes_every_instance_after_its_last_flight() -> None:
    check_landing_system(CannotFlyClosed, seconds=1.0)
    assert CannotFlyClosed.open == []


def test_the_check_names_an_error_of_close() -> None:
    with pytest.raises(LandingSystemError, match="the port is gone"):
        check_landing_system(LandsThenRaises, seconds=15.0)
