from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

pytest.importorskip("torch")
from pytest_garl.npcs.training.dqn import EpisodeRecord, Learner
from pytest_garl.npcs.training.presets import Training
from pytest_garl.npcs.training.selection import draw_curves, validate
from tests.npcs.training.surrogates import OURS


@pytest.mark.parametrize("episodes", [1, 120])
def test_the_curves_of_all_seeds_are_one_picture(tmp_path: Path, episodes: int) -> None:
    curve = [
        EpisodeRecord(
            episode=index, reward=0.1 * index, decisions=9, collided=bool(index % 2), epsilon=0.5
        )
        for index in range(episodes)
    ]
    path = tmp_path / "new" / "curves.png"
    draw_curves({0: curve, 1: curve[::-1]}, path)
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.sim
@pytest.mark.long
def test_validation_is_the_same_for_any_number_of_processes() -> None:
    network = Learner(10, 5, Training()).policy("relative")
    blind = dataclasses.replace(OURS, uav="straight")
    one, two = (validate(network, blind, 6, processes) for processes in (1, 2))
    assert one == two
    assert one.episodes == 6
