from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.errors import OptionError
from pytest_garl.verdicts.verdict import Limits, Margin, Verdict, count_decided, default_distance_m


def verdict(violation: bool) -> Verdict:
    return Verdict(
        outcome="landed",
        primary=None,
        violation_type=None,
        signature="",
        paper_violation=violation,
        margins=(),
        story="",
    )


def test_decided_properties_are_counted_over_flights() -> None:
    def flown(distance: bool, time: bool) -> Verdict:
        margins = (
            Margin(property="distance", value=1.0, unit="m", decided=distance),
            Margin(property="time", value=1.0, unit="s", decided=time),
        )
        return dataclasses.replace(verdict(False), margins=margins)

    # A flight whose process died has no margins at all.
    flights = [flown(True, True), flown(False, True), flown(False, False), verdict(False)]
    assert (count_decided(flights, "distance"), count_decided(flights, "time")) == (1, 2)


@pytest.mark.parametrize("value", [300.001, -1.0, float("nan"), float("inf"), "120", True])
def test_time_limit_has_a_maximum(value: float) -> None:
    assert Limits(time_s=300.0).time_s == 300.0
    with pytest.raises(OptionError, match=r"limits: found time_s=.* expected a number from 0 to"):
        Limits(time_s=value)


def test_invalid_limits_are_refused() -> None:
    with pytest.raises(OptionError, match=r"found distance_m=-0.5, expected a number from 0 to 10"):
        Limits(distance_m=-0.5)
    with pytest.raises(
        OptionError, match="found abort='no', expected 'needless', 'ok' or 'violation'"
    ):
        Limits(abort="no")  # type: ignore[arg-type]


def test_the_limit_of_distance_follows_the_marker() -> None:
    assert default_distance_m(1.5) == Limits().distance_m
    assert default_distance_m(0.2) == 0.3
    assert default_distance_m(4.0) == 2.0
