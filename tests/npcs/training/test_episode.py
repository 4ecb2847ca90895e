from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.npcs.training.episode import Episode, draw_episode
from pytest_garl.npcs.training.uav_models import StraightPilot
from pytest_garl.simulation.npc_policy import STAY
from tests.npcs.training.surrogates import COURT


@pytest.mark.sim
def test_a_time_out_ends_with_the_last_decision() -> None:
    scenario, place = draw_episode(COURT[0], ["dog"], np.random.default_rng(0))
    episode = Episode(scenario, place, StraightPilot, time_limit_s=3.0)
    ends = []
    for _ in range(6):
        episode.step([STAY])
        ends.append(episode.outcome)
    episode.close()
    assert ends == [None] * 5 + ["not_landed"]
