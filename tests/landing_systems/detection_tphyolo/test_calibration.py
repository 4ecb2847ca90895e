from __future__ import annotations

import numpy as np
import pytest

from landing_systems.modules.detection_tphyolo.calibration import (
    calibration_error,
    fit,
    reliability,
)


def test_fitting_finds_the_slope_and_offset_that_made_the_data() -> None:
    rng = np.random.default_rng(0)
    logits = rng.normal(0, 3, 20_000)
    right = rng.random(20_000) < 1 / (1 + np.exp(-(0.6 * logits - 1.0)))
    slope, offset = fit(logits.tolist(), right.tolist())
    assert slope == pytest.approx(0.6, abs=0.03)
    assert offset == pytest.approx(-1.0, abs=0.05)


def test_separable_data_gives_a_finite_slope() -> None:
    slope, offset = fit([-5.0, -4.0, 4.0, 5.0], [False, False, True, True])
    assert 0 < slope < 10
    assert abs(offset) < 1


def test_fitting_needs_right_and_wrong() -> None:
    with pytest.raises(ValueError, match="2 right and 0 wrong"):
        fit([1.0, 2.0], [True, True])


def test_bins_say_how_often_a_confidence_is_right() -> None:
    bins = reliability([0.91, 0.95, 0.99, 0.15, 1.0], [True, True, False, False, True])
    assert [(each.count, each.right) for each in bins] == [(1, 0.0), (4, 0.75)]
    assert bins[1].confidence == pytest.approx(0.9625)
    assert calibration_error(bins) == pytest.approx((0.15 + 4 * 0.2125) / 5)
