"""Scenarios of violations that the docs show and that are no saved cases."""

from __future__ import annotations

from pathlib import Path

import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.files import load
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

FOLDER = Path(__file__).parents[2] / "scenarios" / "found"


@pytest.mark.sim
def test_opencv_comes_down_on_a_decoy_and_hits_the_tree_beside_it() -> None:
    flight = fly(load(FOLDER / "tree.toml"), OpenCvLandingSystem, policy_spec("graded"))
    assert judge(flight, DEFAULT_LIMITS).signature == "III:tree:descent"
