"""An observation cannot be changed."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import numpy as np
import pytest

from pytest_garl import (
    Command,
    Observation,
)
from tests.support.answers import flight_of
from tests.support.flights import Scripted


def test_observation_cannot_be_made_writeable_again() -> None:
    class Unlocks(Scripted):
        def step(self, observation: Observation) -> Command:
            observation.depth_m.flags.writeable = True
            return self.hover(2.0)

    crash = flight_of(Unlocks).crash
    assert crash.error == "ValueError"
    assert "WRITEABLE" in crash.message


def test_an_observation_is_called_so_and_names_the_field_that_was_meant() -> None:
    class Misspells(Scripted):
        def step(self, observation: Observation) -> Command:
            assert repr(observation).startswith("Observation(")
            assert not hasattr(observation, "gps")
            return self.hover(observation.rangefinder)  # type: ignore[attr-defined]

    crash = flight_of(Misspells).crash
    assert crash.error == "AttributeError"
    assert crash.message == "Observation has no 'rangefinder'; did you mean rangefinder_m?"


def test_an_observation_can_be_copied() -> None:
    class Copies(Scripted):
        def step(self, observation: Observation) -> Command:
            assert (copy.copy(observation).image == observation.image).all()
            return self.hover(2.0)

    assert flight_of(Copies).crash is None


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
