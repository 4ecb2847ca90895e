from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pytest_garl.adversary.learned import Network, save
from pytest_garl.simulation.npc_policy import PolicySpec
from studies import team
from tests.support.situations import being, situation


def test_an_object_without_a_fellow_sees_one_far_behind() -> None:
    assert team.state_with_nearest_object(situation(being((4.0, 3.0))))[-2:] == pytest.approx(
        [-2.0, 0.0]
    )


def test_an_object_sees_its_nearest_fellow() -> None:
    fellows = (being((4.0, 8.0), name="far"), being((4.0, 5.0), name="near"))
    seen = situation(being((4.0, 3.0)), uav=(9.0, 3.0, 5.0), others=fellows)
    assert team.state_with_nearest_object(seen)[-2:] == pytest.approx([0.0, 0.2])


def test_the_policy_takes_the_action_of_the_highest_value(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(team, "JOINT_WEIGHTS", tmp_path / "together.npz")
    bias = np.array([0.0, 0.0, 0.0, 1.0, 0.0])
    save(team.JOINT_WEIGHTS, Network(state="fellow", layers=((np.zeros((5, 12)), bias),)), {})
    team._network.cache_clear()
    policy = PolicySpec(name="together", factory="studies.team:JointlyTrainedPolicy").make()
    here = situation(being((4.0, 3.0)))
    policy.reset(here, np.random.default_rng(0))
    assert policy.decide(here) == team.ENCODING.moves(here)[3]
    team._network.cache_clear()
