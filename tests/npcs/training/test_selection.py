from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("torch")
from pytest_garl.npcs.training.dqn import EpisodeRecord
from pytest_garl.npcs.training.selection import draw_curves


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
