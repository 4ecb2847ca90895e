from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.columns import Columns
from pytest_garl.search.model import PROPERTIES, MarginModel, inverse, proximities, share_above
from pytest_garl.search.operators import Matrix
from pytest_garl.verdicts.verdict import Margin, MarginName
from tests.support.results import flight_result

MAP = load_map("court")
COLUMNS = Columns(genome_of(domain_named("field"), MAP))
KEYS = COLUMNS.genome.keys


def row_with(**values: float) -> Matrix:
    """Return a chromosome in which only the genes of these values act, by key with __ for a dot."""
    keys = {key.replace("__", ".").replace("_1", "-1"): value for key, value in values.items()}
    row = COLUMNS.with_active(COLUMNS.genome.nominal, tuple({k.split(".")[0] for k in keys}))
    for key, value in keys.items():
        row[KEYS.index(key)] = value
    return row


def rows_of(winds: Iterable[float], errors: Iterable[float]) -> Matrix:
    """Return chromosomes with a wind, a told coordinate that errs, or both."""
    made = []
    for wind, error in zip(winds, errors, strict=True):
        values = {"wind__mean_mps": wind} if wind else {}
        made.append(row_with(**values, **({"told__error_m": error} if error else {})))
    return np.array(made)


def fitted(rows: Matrix, near: Matrix) -> MarginModel:
    """Return a model whose first property comes as near as told, and whose others never do."""
    proximity = np.zeros((len(rows), len(PROPERTIES)))
    proximity[:, 0] = near
    fails = (near >= 1).astype(float)
    return MarginModel(COLUMNS, rows, proximity, fails, fails)


@pytest.mark.parametrize("size", [1, 2, 30])
def test_the_inverse_is_that_of_linear_algebra(size: int) -> None:
    half = np.random.default_rng(size).normal(size=(size, size))
    matrix = half @ half.T + 0.3 * np.eye(size)
    assert np.allclose(inverse(matrix), np.linalg.inv(matrix))


def test_a_harsher_value_than_any_that_was_flown_is_expected_to_come_nearer() -> None:
    winds = np.linspace(0.5, 3.0, 12)
    model = fitted(rows_of(winds, [0.0] * 12), winds / 4)
    near = model.predict(rows_of([1.0, 3.0, 6.0], [0.0] * 3)).proximity[:, 0]
    assert near[0] < near[1] < near[2]


def test_two_conditions_together_are_told_from_each_of_them() -> None:
    rng = np.random.default_rng(2)
    winds, errors = rng.uniform(2, 6, 60), rng.uniform(1, 5, 60)
    winds[:20] = 0.0
    errors[20:40] = 0.0
    both = (winds > 0) & (errors > 0)
    model = fitted(rows_of(winds, errors), np.where(both, 1.2, 0.1))
    expected = model.predict(rows_of([4.0, 0.0, 4.0], [0.0, 3.0, 3.0]))
    assert expected.proximity[2, 0] > 0.8 > 0.4 > max(expected.proximity[:2, 0])
    assert expected.fails[2] > 0.6 > 0.3 > max(expected.fails[:2])


def test_what_is_unlike_the_flights_is_less_known() -> None:
    model = fitted(rows_of([2.0, 3.0, 4.0], [0.0] * 3), np.array([0.2, 0.3, 0.4]))
    expected = model.predict(rows_of([3.0, 0.0], [0.0, 3.0]))
    assert expected.variance[0] < expected.variance[1]
    assert expected.likeness[0, 1] == pytest.approx(1.0)
    assert expected.likeness[1].max() < expected.likeness[0].min()


def test_a_choice_is_told_by_its_name_and_not_by_its_number() -> None:
    kinds = np.array([0.5, 1.5, 2.5, 3.5] * 6)
    rows = np.array([row_with(decoy_1__kind=kind, decoy_1__x_m=1.0) for kind in kinds])
    model = fitted(rows, np.where(kinds == 2.5, 1.0, 0.0))
    asked = np.array([row_with(decoy_1__kind=k, decoy_1__x_m=1.0) for k in (1.5, 2.1, 2.9, 3.5)])
    near = model.predict(asked).proximity[:, 0]
    assert near[1] == near[2] > 2 * max(near[0], near[3])


def test_a_genome_without_optional_genes_has_a_model_too() -> None:
    columns = Columns(genome_for(MAP))
    rng = np.random.default_rng(0)
    rows = np.array([columns.genome.random(rng) for _ in range(40)])
    proximity = np.repeat(rows[:, :1] / columns.upper[0], len(PROPERTIES), axis=1)
    expected = MarginModel(columns, rows, proximity, np.zeros(40), np.zeros(40)).predict(rows)
    assert np.corrcoef(expected.proximity[:, 0], proximity[:, 0])[0, 1] > 0.8


def test_only_the_latest_flights_are_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pytest_garl.search.model.MOST_FLIGHTS", 4)
    rows = rows_of([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [0.0] * 6)
    near = np.array([9.0, 9.0, 0.1, 0.1, 0.1, 0.1])
    late = fitted(rows[2:], near[2:]).predict(rows)
    expected = fitted(rows, near).predict(rows)
    assert np.array_equal(expected.proximity, late.proximity)
    assert expected.likeness.shape == (6, 4)


def near_of(name: MarginName, value: float, **result: Any) -> float:
    margins = (Margin(property=name, value=value, unit="m"),)
    found = proximities(flight_result(margins=margins, **result))
    return float(found[PROPERTIES.index(name)])


def test_a_proximity_is_a_share_of_the_way_from_safe_to_violated() -> None:
    assert near_of("distance", 0.5) == 0.0
    assert near_of("distance", 0.25) == 0.5
    assert near_of("distance", 9.0) == -0.5
    assert near_of("distance", -0.1) == pytest.approx(0.99)
    assert near_of("distance", -0.1, signature="off", primary="distance") == pytest.approx(1.2)


def test_a_share_above_a_limit_is_half_at_it_and_grows() -> None:
    shares = share_above(np.array([-1e9, 0.5, 1.0, 2.0, 1e9]), 1.0, np.full(5, 0.5))
    assert shares[2] == 0.5
    assert list(shares) == sorted(shares)
    assert 0 <= shares[0] < 0.001 < 0.999 < shares[-1] <= 1
