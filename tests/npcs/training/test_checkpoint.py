from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

pytest.importorskip("torch")
from pytest_garl.errors import GarlError
from pytest_garl.npcs.training.checkpoint import (
    identity_of,
    restore_checkpoint,
    save_checkpoint,
)
from pytest_garl.npcs.training.dqn import Learner
from pytest_garl.npcs.training.presets import Training
from tests.npcs.training.surrogates import OURS, PAPERS


def test_another_kind_of_episode_is_another_training() -> None:
    first = identity_of(OURS, Training())
    assert first == identity_of(dataclasses.replace(OURS), Training())
    others = (
        identity_of(dataclasses.replace(OURS, environment="drawn"), Training()),
        identity_of(OURS, Training(seed=1)),
        identity_of(PAPERS, Training()),
    )
    assert len({first, *others}) == 4


def test_a_checkpoint_of_another_training_is_refused(tmp_path: Path) -> None:
    learner, checkpoint = Learner(10, 5, Training()), tmp_path / "half.pt"
    save_checkpoint(learner, checkpoint, "ours")
    restore_checkpoint(learner, checkpoint, "ours")
    with pytest.raises(GarlError, match="belongs to another training"):
        restore_checkpoint(learner, checkpoint, "another")


@pytest.mark.parametrize("nonsense", [b"", b"nonsense"])
def test_a_damaged_checkpoint_is_refused(tmp_path: Path, nonsense: bytes) -> None:
    checkpoint = tmp_path / "half.pt"
    checkpoint.write_bytes(nonsense)
    with pytest.raises(GarlError, match="cannot be read"):
        restore_checkpoint(Learner(10, 5, Training()), checkpoint, "ours")
