from __future__ import annotations

import dataclasses

import pytest

pytest.importorskip("torch")
from pytest_garl.npcs.training.dqn import Learner
from pytest_garl.npcs.training.presets import Training
from pytest_garl.npcs.training.validation import validate
from tests.npcs.training.surrogates import OURS


@pytest.mark.sim
def test_validation_is_the_same_for_any_number_of_processes() -> None:
    network = Learner(10, 5, Training()).policy("relative")
    blind = dataclasses.replace(OURS, uav="straight")
    one, two = (validate(network, blind, 6, processes) for processes in (1, 2))
    assert one == two
    assert one.episodes == 6
