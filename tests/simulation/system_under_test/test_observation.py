"""An observation cannot be changed, and the flight records which of its data was read."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl import (
    Command,
    Observation,
)
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load, save
from pytest_garl.simulation.fly import fly
from tests.support.answers import flight_of
from tests.support.flights import EMPTY, STAND, Scripted, nominal


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


class Climbs(Scripted):
    """Climbs a little for a second, and reads nothing but the time."""

    needs_camera = True

    def step(self, observation: Observation) -> Command:
        self.read(observation)
        return self.hover(2.0 + self.told)

    told = 0.0

    def read(self, observation: Observation) -> None:
        observation.position_m.sum()


class ReadsDepth(Climbs):
    def read(self, observation: Observation) -> None:
        self.told = float((observation.depth_m == 0).mean())


def flown(system: type, **genes: float) -> Flight:
    return fly(nominal(**genes), system, STAND, map=EMPTY, time_limit_s=2.0)


HOLES = {"depth__range_m": 1.5, "depth__holes_percent": 60.0}


def test_a_depth_that_is_never_read_cannot_change_a_flight() -> None:
    clear, limited = flown(Climbs), flown(Climbs, **HOLES)
    assert limited.data_read == clear.data_read == ()
    assert limited.sha256 == clear.sha256
    assert limited.steps == clear.steps
    assert limited.nominal_views == clear.nominal_views


def test_a_depth_that_is_read_can_change_a_flight_and_is_recorded(tmp_path: Path) -> None:
    clear, limited = flown(ReadsDepth), flown(ReadsDepth, **HOLES)
    assert limited.sha256 != clear.sha256
    assert limited.data_read == ("depth_m",)
    save(limited, tmp_path / "flight.npz")
    assert load(tmp_path / "flight.npz").data_read == ("depth_m",)


EVERYTHING = ("image", "depth_m", "rangefinder_m")


@pytest.mark.parametrize(
    ("read", "fields"),
    [
        (lambda observation: observation.image, ("image",)),
        (lambda observation: observation.rangefinder_m, ("rangefinder_m",)),
        (dataclasses.asdict, EVERYTHING),
        (copy.deepcopy, EVERYTHING),
        (pickle.dumps, EVERYTHING),
        (lambda observation: dataclasses.replace(observation, time_s=0.0), EVERYTHING),
        (lambda observation: (observation.time_s, observation.attitude), ()),
    ],
)
def test_whoever_copies_an_observation_has_read_it(
    read: Callable[[Observation], Any], fields: tuple[str, ...]
) -> None:
    class Reads(Climbs):
        def read(self, observation: Observation) -> None:
            read(observation)

    assert flown(Reads).data_read == fields


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
