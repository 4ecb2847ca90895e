"""The detectability oracle: a probability, monotone where physics says so, true to pictures."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.flight.detectability import (
    FEATURES,
    READABLE,
    Network,
    features,
    readable_probability,
)
from pytest_garl.flight.flight import MarkerView
from tests.verdicts.flights import CLEAR, FOGGY


def between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


VALUES = {
    "share_in_frame": between(0.0, 1.0),
    "px_per_module": between(0.0, 60.0),
    "border_hidden": between(0.0, 1.0),
    "bits_hidden": between(0.0, 1.0),
    "contrast": between(0.0, 255.0),
    "noise": between(0.0, 20.0),
    "blur_px": between(0.0, 60.0),
    "margin_hidden": between(0.0, 1.0),
    "uneven_light": between(0.0, 0.5),
    "clutter": between(0.0, 1.0),
    "edge_modules": between(-40.0, 1.0),
}
VIEWS = st.builds(MarkerView, **VALUES)
BETTER = ("share_in_frame", "px_per_module", "contrast", "edge_modules")
"""More of these never lowers the probability; more of all others never raises it."""


def test_every_fact_of_a_view_is_tested() -> None:
    assert set(VALUES) == {field.name for field in dataclasses.fields(MarkerView)}


@given(VIEWS)
def test_every_view_has_a_probability(view: MarkerView) -> None:
    assert 0.0 <= readable_probability(view) <= 1.0
    assert len(features(view)) == len(FEATURES)


@pytest.mark.parametrize("name", VALUES)
@given(data=st.data())
def test_a_better_view_is_never_read_less(name: str, data: st.DataObject) -> None:
    view, other = data.draw(VIEWS), data.draw(VALUES[name])
    low, high = sorted((getattr(view, name), other))
    worse, better = (low, high) if name in BETTER else (high, low)
    chances = [
        readable_probability(dataclasses.replace(view, **{name: value}))
        for value in (worse, better)
    ]
    # Rounding in the last place may differ.
    assert chances[0] <= chances[1] + 1e-12


def test_no_view_is_not_read() -> None:
    assert readable_probability(None) == 0.0


def test_a_clear_marker_is_read_and_one_in_thick_fog_is_not() -> None:
    assert readable_probability(CLEAR) > 0.95
    assert readable_probability(FOGGY) < 0.05


@pytest.mark.parametrize(
    "change",
    [
        {"px_per_module": 0.8},
        {"border_hidden": 1.0, "bits_hidden": 0.6, "contrast": 0.0},
        {"bits_hidden": 0.6, "border_hidden": 0.6},
        {"clutter": 1.0},
        {"share_in_frame": 0.1, "edge_modules": -6.3},
        {"blur_px": 15.0},
        {"contrast": 2.0, "noise": 4.8},
    ],
)
def test_each_fact_can_make_a_clear_marker_unreadable(change: dict[str, float]) -> None:
    assert readable_probability(dataclasses.replace(CLEAR, **change)) < READABLE


def test_a_network_is_what_its_equation_says() -> None:
    network = Network(
        weights=((2.0, 0.0), (1.0, 3.0)), biases=(-1.0, 0.5), outputs=(4.0, 1.0), bias=-2.0
    )
    first, second = (1 / (1 + math.exp(-each)) for each in (2 * 0.3 - 1, 0.3 + 3 * 0.7 + 0.5))
    expected = 1 / (1 + math.exp(-(4 * first + second - 2)))
    found = network.probabilities(np.array([[0.3, 0.7]]))
    assert found == pytest.approx([expected])
