"""The facts of a flight are derived once, however many verdicts, margins and stories ask."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.verdicts import evidence
from pytest_garl.verdicts.verdict import Limits
from tests.verdicts.flights import CLEAR, flight, step, touchdown

REPORTS = (0.1, 0.0, 0.0)


@pytest.mark.parametrize("outcome", ["landed", "gave_up", "not_landed", "slid"])
def test_a_judgement_derives_each_fact_once(outcome: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: Counter[str] = Counter()

    def counted(name: str) -> None:
        derive = getattr(evidence, name)

        def derived(*given: Any) -> Any:
            asked[name] += 1
            return derive(*given)

        monkeypatch.setattr(evidence, name, derived)

    for name in ("stays_of", "readable_probability", "target_of"):
        counted(name)
    steps = tuple(
        step(time_s, target=REPORTS, detected=REPORTS, visible=1.0, marker=CLEAR)
        for time_s in (5.0, 15.0, 25.0)
    )
    last = touchdown(2.0, on="nothing")
    result = judged(flight(outcome, (2.0, 0.0, 0.2), steps=steps, touchdown=last), Limits())
    assert result.off_marker_m == 2.0
    assert asked == {"stays_of": 1, "readable_probability": 3, "target_of": 3}
