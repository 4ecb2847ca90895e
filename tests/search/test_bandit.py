from __future__ import annotations

from collections import Counter

import numpy as np

from pytest_garl.search.bandit import Bandit


def test_a_successful_arm_is_chosen_more_often() -> None:
    bandit, rng = Bandit(), np.random.default_rng(0)
    chosen: Counter[str] = Counter()
    for _ in range(300):
        arm = bandit.choose(["good", "bad"], rng)
        chosen[arm] += 1
        bandit.learn(arm, 0.6 if arm == "good" else 0.1)
    assert chosen["good"] > 2 * chosen["bad"] > 0


def test_arms_without_trials_are_chosen_alike() -> None:
    bandit, rng = Bandit(), np.random.default_rng(1)
    chosen = Counter(bandit.choose(["a", "b", "c"], rng) for _ in range(900))
    assert min(chosen.values()) > 240


def test_an_arm_that_stops_succeeding_is_forgotten() -> None:
    bandit, rng = Bandit(), np.random.default_rng(2)
    for _ in range(50):
        bandit.learn("old", 1.0)
    for _ in range(30):
        bandit.learn("old", 0.0)
    chosen = Counter(bandit.choose(["old", "new"], rng) for _ in range(100))
    assert chosen["new"] > 70
