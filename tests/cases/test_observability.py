from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.cases.observability import OBSERVABLE_PX, first_observation_s
from pytest_garl.flight.flight import Flight, Step
from tests.support.blind_lander import blind_flight


def flight(*pixels: int) -> Flight:
    """Return a flight whose frames, 0.1 s apart, show so many pixels of a dog."""
    steps = tuple(
        Step(
            time_s=0.1 * number,
            command="Land",
            marker_visible=0.0,
            marker_px=0.0,
            objects_visible=("bird-1", "dog-1") if count else ("bird-1",),
            diagnostics=None,
            objects_px=(900, count) if count else (900,),
        )
        for number, count in enumerate(pixels)
    )
    return dataclasses.replace(blind_flight("dog-1", "stationary"), steps=steps)


@pytest.mark.sim
def test_body_is_observed_in_the_second_of_two_frames_with_enough_pixels() -> None:
    enough, few = OBSERVABLE_PX, OBSERVABLE_PX - 1
    assert first_observation_s(flight(0, enough, enough, 900), "dog-1", 0.0) == pytest.approx(0.2)
    assert first_observation_s(flight(900, 0, 900, few, 900), "dog-1", 0.0) is None
    assert first_observation_s(flight(900, few, enough, enough), "dog-1", 0.0) == pytest.approx(0.3)
    assert first_observation_s(flight(), "dog-1", 0.0) is None


@pytest.mark.sim
def test_observation_long_before_does_not_count() -> None:
    seen = flight(900, 900, 900, 0, 0, 900, 900)
    assert first_observation_s(seen, "dog-1", 0.15) == pytest.approx(0.6)
    assert first_observation_s(seen, "person-1", 0.0) is None
