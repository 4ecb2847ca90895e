"""Two genes place a thing anywhere on a disc, evenly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed, disc_to_square, square_to_disc


def test_uniform_genes_give_a_uniform_disc() -> None:
    rng = np.random.default_rng(0)
    radii = [np.hypot(*square_to_disc(*rng.uniform(-1, 1, 2))) for _ in range(4000)]
    # For a uniform disc the squared radius is uniform on [0, 1]: mean 1/2, variance 1/12.
    assert np.mean(np.square(radii)) == pytest.approx(0.5, abs=0.02)
    assert np.var(np.square(radii)) == pytest.approx(1 / 12, abs=0.01)


@given(x=st.floats(-1, 1), y=st.floats(-1, 1))
def test_disc_to_square_inverts_square_to_disc(x: float, y: float) -> None:
    back = disc_to_square(*square_to_disc(x, y))
    assert square_to_disc(*back) == pytest.approx(square_to_disc(x, y), abs=1e-9)


def test_the_told_coordinate_is_the_maps_or_the_markers_and_has_an_error() -> None:
    court = load_map("court")
    genome = genome_for(court)
    plain = decode(genome.nominal, genome, map="court", seed=1)
    plain = plain.replace({"marker.x": 0.5, "marker.y": -0.4})
    marker = Placed(plain, court).marker_m
    assert Placed(plain, court).told_m == court.gps_position_m != marker
    surveyed = plain.replace({"told.surveyed": 1.0})
    assert Placed(surveyed, court).told_m == marker
    north = surveyed.replace({"told.error_m": 4.0, "told.towards_deg": 90.0})
    assert Placed(north, court).told_m == pytest.approx((marker[0], marker[1] + 4.0))
