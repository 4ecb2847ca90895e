"""The study of where detection fails."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.scenarios.domains.domain import ELEVATION
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.units import sections_of
from studies import bands


def test_only_one_condition_acts() -> None:
    scenario = bands.scenario_of("weather.fog_visibility_m", 20.0, 3)
    sections = sections_of(scenario, bands._map(scenario.map))
    assert sections["weather"] == {"fog_visibility_m": pytest.approx(20.0)}
    assert set(sections) <= {"weather", "marker"}


def test_thicker_fog_takes_contrast() -> None:
    rng = np.random.default_rng(1)
    contrasts = []
    for visibility in (66.0, 15.0):
        scenario = bands.scenario_of("weather.fog_visibility_m", visibility, 3)
        contrasts.append(bands.frame_of(scenario, bands.SEARCH_M, rng).view.contrast)
    assert contrasts[1] < 0.4 * contrasts[0]


def test_every_range_of_field_is_measured_at_its_end() -> None:
    ranges = {key: (low, high) for key, low, high in domain_named("field").ranges}
    for condition, values in bands.VALUES.items():
        low, high = ranges[condition]
        end = low if condition == ELEVATION or "visibility" in condition else high
        assert end in values


def test_the_better_detector_reads_half_at_each_end_and_the_table_says_so() -> None:
    ranges = {key: (low, high) for key, low, high in domain_named("field").ranges}
    seen = 0
    for row in bands.TABLE.rows():
        low, high = ranges[row["condition"]]
        visibility = row["condition"] == ELEVATION or "visibility" in row["condition"]
        if float(row["value"]) == (low if visibility else high):
            seen += 1
            best = max(int(row["stock"]), int(row["learned"]))
            assert best >= int(row["frames"]) / 2, row
    assert seen >= len(bands.VALUES)
