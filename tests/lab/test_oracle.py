from __future__ import annotations

import math

import numpy as np
import pytest

from lab.oracle import LURK_M, Oracle
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.simulation.npc_policy import STAY, Move
from tests.support.situations import being, situation

ORACLE = policy_spec("lab.oracle:Oracle")


def decided(east_m: float, uav_height_m: float) -> Move:
    policy = ORACLE.make()
    seen = situation(being((east_m, 0.0)), uav=(0.0, 0.0, uav_height_m))
    policy.reset(seen, np.random.default_rng(0))
    return policy.decide(seen)


def test_a_class_is_named_by_its_module() -> None:
    assert isinstance(ORACLE.make(), Oracle)
    assert ORACLE.grade == "hostile"


def test_it_goes_when_that_hits_waits_when_going_later_hits_and_else_withdraws() -> None:
    assert decided(2.0, 3.0).x == pytest.approx(-1.0)
    assert decided(3.0, 4.5) == STAY
    assert decided(1.0, 6.0).x == pytest.approx(1.0)


def test_it_lurks_the_farther_away_the_higher_the_uav_is() -> None:
    """The UAV sinks at 1.5 m/s; 12 m up it needs some 6.7 s down to a person's head."""
    assert decided(LURK_M, 12.0).x > 0
    assert decided(14.0, 12.0).x < 0
    lurk_m = 0.8 * 2.0 * (12.0 - 0.24 - being((0.0, 0.0)).top_m) / 1.5
    assert math.isclose(decided(lurk_m, 12.0).x, 0.0, abs_tol=1e-9)
