"""How often the gate is wrong, in few draws; ``python -m studies.gate rates`` takes many."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.baselines.comparison import LEVEL
from pytest_garl.verdicts.statistics import share_interval
from studies.gate_rates import KNOWN, NEW, detected, false_alarms, landing_always, measured
from studies.gate_sizes import CHANGES, size_detected

DRAWS = 300
SYSTEM = measured("MM-MLS", "random")


@pytest.mark.parametrize("budget", [50, 100])
@pytest.mark.parametrize("part", [0.25, 1.0])
@pytest.mark.parametrize("rare", [False, True])
def test_an_unchanged_system_fails_no_more_often_than_the_level(
    budget: int, part: float, rare: bool
) -> None:
    stack = SYSTEM.with_rare(budget) if rare else SYSTEM
    found = false_alarms(stack, budget, part, DRAWS, np.random.default_rng(1))
    low, _ = share_interval(found.gate, DRAWS)
    assert low <= LEVEL
    assert found.gate <= found.uncorrected


def test_a_gate_without_correction_fails_more_often_than_the_level() -> None:
    found = false_alarms(SYSTEM.with_rare(50), 50, 1.0, DRAWS, np.random.default_rng(1))
    low, _ = share_interval(found.uncorrected, DRAWS)
    assert low > LEVEL


def test_the_gate_detects_a_worse_system() -> None:
    rng = np.random.default_rng(1)
    worse = detected(SYSTEM, 100, 0.1, 0.2, KNOWN, 0.0, 100, rng)
    new = detected(SYSTEM, 100, 1.0, 0.05, NEW, 0.5, 100, rng)
    same = detected(SYSTEM, 100, 0.1, 0.0, KNOWN, 0.0, 100, rng)
    assert worse >= 95
    assert new >= 90
    assert same <= 5


def test_the_gate_detects_landings_that_are_less_accurate_or_slower() -> None:
    rng = np.random.default_rng(1)
    found = {each.name: size_detected(each, 50, 0.1, 10, rng) for each in CHANGES}
    assert found["distance + 0.38 m"] == found["time + 20 s"] == found["time × 1.3"] == 10
    # Landings of 2 cm in 20 s stay within 5 cm and a tenth of the time.
    assert found["distance × 1.3"] == 0


def test_landings_drawn_anew_fail_no_more_often_than_the_level() -> None:
    found = false_alarms(landing_always(), 50, 1.0, DRAWS, np.random.default_rng(1))
    low, _ = share_interval(found.gate, DRAWS)
    assert low <= LEVEL
