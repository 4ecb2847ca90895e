"""Wind over the pad."""

from __future__ import annotations

import math

from pytest_garl.scenarios.scenario import Scenario


def mean_wind_mps(scenario: Scenario) -> tuple[float, float]:
    """Return the mean velocity (x, y) of the air."""
    speed, towards = scenario["wind.mean_mps"], math.radians(scenario["wind.towards_deg"])
    return speed * math.cos(towards), speed * math.sin(towards)
