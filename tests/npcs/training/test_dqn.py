from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")
from pytest_garl.npcs.training.dqn import Experience, Learner
from pytest_garl.npcs.training.presets import Training


def test_experience_sums_the_rewards_of_several_steps_up_to_the_end() -> None:
    learner = Learner(10, 5, Training(steps=3, discount=0.5, replay=10))
    step = Experience(learner)
    states = [np.full(10, index, np.float32) for index in range(6)]
    for index in range(4):
        step.add(states[index], index, 1.0, states[index + 1], terminated=False, truncated=False)
    assert learner.stored == 2
    step.add(states[4], 4, 8.0, states[5], terminated=True, truncated=False)
    assert learner.stored == 5
    # 1 + 1/2 + 1/4; then with the last 8; a terminated episode has no further reward.
    assert learner.sums[:5] == pytest.approx([1.75, 1.75, 1.5 + 2.0, 1.0 + 4.0, 8.0])
    assert learner.discounts[:5] == pytest.approx([0.125, 0.125, 0, 0, 0])
    assert [int(state[0]) for state in learner.afters[:2]] == [3, 4]
    timed_out = Experience(learner)
    timed_out.add(states[0], 0, 1.0, states[1], terminated=False, truncated=True)
    assert learner.discounts[5] == pytest.approx(0.5)


def test_a_learner_learns_which_action_pays() -> None:
    learner = Learner(4, 5, Training(steps=1, warm_up=64, target_every=50))
    rng = np.random.default_rng(0)
    for _ in range(600):
        state = rng.normal(size=4).astype(np.float32)
        action = int(rng.integers(5))
        learner.remember(state, action, float(action == (0 if state[0] > 0 else 2)), state, 0.0)
        learner.update()
    states = rng.normal(size=(200, 4)).astype(np.float32)
    best = learner.act(states, epsilon=0.0)
    assert (best == np.where(states[:, 0] > 0, 0, 2)).mean() > 0.95
    policy = learner.policy("paper")
    assert [int(policy.values(state).argmax()) for state in states] == best.tolist()
