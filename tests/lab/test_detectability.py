"""The study of the detectability oracle, and its coefficients on frames that it never saw."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from lab.detectability import COLUMNS, features_of, half_of, table_of
from lab.detectability_fit import auc, brier, deciles, fit, tenths
from lab.detectability_frames import FRAMES, MAPS, Detectors, ReadFrame, read_frames
from pytest_garl.flight.detectability import readable_probability

FRESH = range(900_000, 900_024)
"""Scenarios that the study does not draw."""


@pytest.fixture(scope="module")
def fresh() -> list[ReadFrame]:
    return frames_of(FRESH[:4])


def frames_of(numbers: range) -> list[ReadFrame]:
    detectors = Detectors()
    return [frame for number in numbers for frame in read_frames(number, detectors)]


@pytest.mark.sim
@pytest.mark.long
def test_the_oracle_predicts_what_detectors_read_in_frames_that_it_never_saw() -> None:
    whole = [frame for frame in frames_of(FRESH) if frame.view.share_in_frame >= 0.9]
    predicted = np.array([readable_probability(frame.view) for frame in whole])
    read = np.array([float(any(frame.read)) for frame in whole])
    assert len(whole) > 200
    assert {frame.map for frame in whole} == set(MAPS)
    assert 0.2 < read.mean() < 0.9
    # The study finds 0.03, and 0.99; a constant has 0.22, and 0.5.
    assert brier(predicted, read) < 0.06
    assert auc(predicted, read) > 0.96
    assert abs(predicted.mean() - read.mean()) < 0.05


@pytest.mark.sim
def test_the_frames_of_a_scenario_are_the_same_again(fresh: list[ReadFrame]) -> None:
    again = read_frames(FRESH[0], Detectors())
    assert again == fresh[: len(again)]
    assert 0 < len(again) <= FRAMES


@pytest.mark.sim
def test_a_frames_row_holds_its_view(fresh: list[ReadFrame]) -> None:
    table = table_of(fresh[:20])
    assert table.shape == (20, len(COLUMNS))
    assert table[3, COLUMNS.index("contrast")] == fresh[3].view.contrast
    assert features_of(table)[3, 0] == pytest.approx(np.log2(fresh[3].view.px_per_module))
    blurred = dataclasses.replace(fresh[3].view, blur_px=2 * fresh[3].view.px_per_module)
    assert readable_probability(blurred) <= readable_probability(fresh[3].view)


def test_halves_have_whole_scenarios_of_both_maps() -> None:
    rows = np.zeros((8, len(COLUMNS)))
    rows[:, 0] = [0, 0, 1, 1, 2, 2, 3, 3]
    assert half_of(rows).tolist() == [0, 0, 0, 0, 1, 1, 1, 1]


def known(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return features, chances that follow from them, and reads drawn by these chances."""
    rng = np.random.default_rng(3)
    features = rng.normal(0, 1, (count, 3))
    chances = 1 / (1 + np.exp(-(2 * features[:, 0] + features[:, 1])))
    return features, chances, (rng.random(count) < chances).astype(float)


def test_a_fit_finds_the_chances_and_ignores_what_plays_no_part() -> None:
    features, chances, read = known(4000)
    network = fit(features, read, units=3)
    assert np.abs(network.probabilities(features) - chances).mean() < 0.03
    assert min(min(row) for row in network.weights) >= 0.0
    assert min(network.outputs) >= 0.0
    moved = features + np.array([0.0, 0.0, 1.0])
    change = network.probabilities(moved) - network.probabilities(features)
    assert np.abs(change).mean() < 0.03


def test_bins_and_scores_are_those_of_their_definitions() -> None:
    _, chances, read = known(5000)
    assert sum(each.count for each in tenths(chances, read)) == 5000
    assert {each.count for each in deciles(chances, read)} == {500}
    assert max(abs(each.error) for each in deciles(chances, read)) < 0.06
    assert max(abs(each.error) for each in deciles(chances**3, read)) > 0.15
    assert brier(read, read) == 0.0
    assert auc(read, read) == 1.0
    assert auc(1 - read, read) == 0.0
    assert auc(np.zeros(5000), read) == pytest.approx(0.5)
