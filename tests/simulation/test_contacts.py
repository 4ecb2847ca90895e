"""What contacts mean: collisions with bodies and with the ground."""

from __future__ import annotations

import pytest

from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, Falls, HitsATree, nominal


def test_a_collision_names_the_body_and_ends_the_flight() -> None:
    flight = fly(nominal(), HitsATree, STAND, map=EMPTY, time_limit_s=40)
    assert flight.contacts[-1].body == "tree-1"
    assert flight.contacts[-1].body_class == "static"
    assert flight.elapsed_s == pytest.approx(flight.contacts[-1].time_s)
    assert min(gap.distance_m for gap in flight.separations) == 0.0


def test_a_hard_touchdown_is_a_collision_with_the_ground() -> None:
    flight = fly(nominal(), Falls, STAND, map=EMPTY, time_limit_s=20)
    assert flight.contacts[-1].body == "ground"
    assert flight.contacts[-1].speed_mps > 2.0
