"""The airframe that a landing system declares, and its end after an abort."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from pytest_garl import (
    Abort,
    Airframe,
    Camera,
    Command,
    Land,
    Observation,
    Rangefinder,
)
from pytest_garl.errors import LandingSystemError
from pytest_garl.landing_system import airframe_of
from tests.support.answers import HUGE, NAN, flight_of
from tests.support.flights import Scripted


class Meta(type):
    @property
    def airframe(cls) -> Airframe:
        raise RuntimeError("no airframe")


class Heavy(Airframe):
    def __getattribute__(self, name: str) -> Any:
        return -1.0 if name == "mass_kg" else super().__getattribute__(name)


@pytest.mark.parametrize(
    ("airframe", "words"),
    [
        ("big", "airframe is 'big'; expected pytest_garl.Airframe"),
        (property(lambda self: 1 / 0), "airframe is a property"),
        (Airframe, "airframe is <class"),
    ],
)
def test_wrong_airframe_is_a_finding_not_silently_the_default(airframe: Any, words: str) -> None:
    system = type("Odd", (Scripted,), {"airframe": airframe, "step": lambda *_: Land()})
    flight = flight_of(system)
    assert (flight.crash.kind, flight.crash.error) == ("nonsense", "BadAirframe")
    assert words in flight.crash.message
    assert flight.crash.where == "Odd.airframe"
    with pytest.raises(LandingSystemError, match=words):
        airframe_of(system)


def test_airframe_of_a_class_that_raises_is_a_finding() -> None:
    system = Meta("Odd", (), {"reset": lambda *_: None, "step": lambda *_: Land()})
    assert flight_of(system).crash.message == "no airframe"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Airframe(mass_kg=-1), "mass_kg = -1; expected a number from 0.1 to 100 kg"),
        (lambda: Airframe(mass_kg=NAN), "mass_kg = nan"),
        (lambda: Airframe(mass_kg=HUGE), "mass_kg = 1000"),
        (lambda: Airframe(size_m=0), "size_m = 0"),
        (lambda: Airframe(latency_s=NAN), "latency_s = nan"),
        (lambda: Airframe(latency_s=-0.1), "latency_s = -0.1"),
        (lambda: Airframe(control_rate_hz=0), "control_rate_hz = 0"),
        (lambda: Airframe(control_rate_hz="fast"), "control_rate_hz = 'fast'"),  # type: ignore[arg-type]
        (lambda: Airframe(camera=None), "camera is of type NoneType"),  # type: ignore[arg-type]
        (lambda: Airframe(navigation="gps"), "navigation = 'gps'; expected rtk, gnss, ideal"),  # type: ignore[arg-type]
        (lambda: Airframe(rangefinder=True), "rangefinder is of type bool"),  # type: ignore[arg-type]
        (lambda: Rangefinder(most_m=NAN), "most_m = nan; expected a number from 0 to 200 m"),
        (lambda: Rangefinder(least_m=6, most_m=2), "from 6 to 2 m: expected least_m below"),
        (lambda: Camera(rate_hz=0), "rate_hz = 0; expected a number from 0.1 to 240 Hz"),
        (lambda: Camera(width_px=0, height_px=0), "width_px = 0; expected a whole number"),
        (lambda: Camera(width_px=320.5), "width_px = 320.5"),  # type: ignore[arg-type]
        (lambda: Camera(width_px=200_000, height_px=200_000), "at most 8294400 pixels"),
        (lambda: Camera(field_of_view_rad=3.5), "field_of_view_rad = 3.5"),
        (lambda: Camera(field_of_view_rad=np.zeros(2)), "field_of_view_rad"),  # type: ignore[arg-type]
        (lambda: Heavy(), "mass_kg"),
    ],
)
def test_impossible_airframe_is_refused_where_it_is_made(
    make: Callable[[], Any], words: str
) -> None:
    with pytest.raises(LandingSystemError) as refused:
        make()
    assert words in str(refused.value)


def test_airframe_of_the_least_and_the_most_can_be_flown() -> None:
    for airframe in (
        Airframe(mass_kg=0.1, size_m=0.1, latency_s=5.0, camera=Camera(width_px=16, height_px=16)),
        Airframe(mass_kg=100.0, size_m=5.0, camera=Camera(field_of_view_rad=3.0, rate_hz=240.0)),
        Airframe(camera=Camera(field_of_view_rad=0.05, rate_hz=0.1)),
    ):
        system = type(
            "Odd",
            (Scripted,),
            {"airframe": airframe, "needs_camera": True, "step": lambda self, _: self.hover(2.0)},
        )
        flight = flight_of(system, 0.5)
        assert flight.outcome in ("not_landed", "collision"), flight.crash
        assert np.isfinite(flight.uav.position_m).all()


class StopsThinking(Scripted):
    def reset(self, mission: Any) -> None:
        super().reset(mission)
        self.over = False

    def step(self, observation: Observation) -> Command:
        assert not self.over
        self.over = observation.time_s >= 3
        return Abort() if self.over else self.hover(3.0)


def test_step_is_not_called_after_abort() -> None:
    flight = flight_of(StopsThinking, 20)
    assert (flight.outcome, flight.crash) == ("gave_up", None)
    times = [step.time_s for step in flight.steps]
    assert times[-1] > 4
    assert {step.command for step in flight.steps if step.time_s >= 3} == {"Abort"}


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield
