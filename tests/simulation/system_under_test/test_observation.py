"""An observation cannot be changed."""

from __future__ import annotations

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


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
