from __future__ import annotations

import dataclasses

from pytest_garl.verdicts.verdict import Margin, Verdict, count_decided
from pytest_garl.verdicts.wording import decided_text


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
    assert decided_text(flights) == "distance decided in 1 of 4 flights, time in 2"
