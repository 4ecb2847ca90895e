from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("torch")
from pytest_garl.npcs.training.dqn import EpisodeRecord
from pytest_garl.npcs.training.presets import Training
from pytest_garl.npcs.training.train import train
from tests.npcs.training.surrogates import OURS


class _StopError(Exception):
    pass


@pytest.mark.sim
@pytest.mark.long
def test_a_killed_training_continues_to_the_same_weights(tmp_path: Path) -> None:
    training = Training(episodes=4, warm_up=64)
    whole = train(OURS, training)

    def stop(record: EpisodeRecord) -> None:
        if record.episode == 2:
            raise _StopError

    checkpoint = tmp_path / "half.pt"
    with pytest.raises(_StopError):
        train(OURS, training, checkpoint, stop, checkpoint_interval=2)
    resumed = train(OURS, training, checkpoint, checkpoint_interval=2)
    assert whole.updates == resumed.updates > 0
    assert whole.history == resumed.history
    for ours, theirs in zip(
        whole.policy("relative").layers, resumed.policy("relative").layers, strict=True
    ):
        assert (ours[0] == theirs[0]).all()
        assert (ours[1] == theirs[1]).all()
