from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lab.foreign.repository import ForeignCodeError
from lab.published import Published, network_of, published_network
from pytest_garl.npcs.learned import Network
from pytest_garl.simulation.npc_policy import STAY, Move
from tests.support.situations import being, situation


def towards_the_marker() -> Network:
    """Values of the actions from the NPC's place: the farther away, the better to go back."""
    weight = np.zeros((24, 4))
    weight[:4, 0], weight[:4, 1] = (-1, 1, 0, 0), (0, 0, -1, 1)
    out = np.zeros((5, 24))
    out[1:, :4] = np.eye(4)
    return Network(state="paper", layers=((weight, np.zeros(24)), (out, np.full(5, -1.0))))


def moves(place: tuple[float, float], heights_m: list[float]) -> list[Move]:
    policy = Published(towards_the_marker())
    seen = [
        situation(being(place), uav=(0.0, 0.0, height), marker=(1.0, 1.0)) for height in heights_m
    ]
    policy.reset(seen[0], np.random.default_rng(0))
    return [policy.decide(each) for each in seen]


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ((-4.0, 1.0), (1.0, 0.0)),
        ((6.0, 2.0), (-1.0, 0.0)),
        ((1.0, -3.0), (0.0, 1.0)),
        ((1.0, 4.0), (0.0, -1.0)),
        ((1.0, 1.0), (0.0, 0.0)),
    ],
)
def test_it_goes_as_the_best_action_says(
    place: tuple[float, float], expected: tuple[float, float]
) -> None:
    (move,) = moves(place, [8.0])
    assert (move.x, move.y) == expected


def test_it_begins_once_the_uav_was_six_metres_up() -> None:
    still, up, down = moves((-4.0, 1.0), [5.9, 6.0, 2.0])
    assert still == STAY
    assert up == down == Move(x=1.0, y=0.0)


def test_weights_are_read_as_pytorch_saved_them(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    layers = torch.nn.Sequential(torch.nn.Linear(4, 24), torch.nn.ReLU(), torch.nn.Linear(24, 5))
    file = tmp_path / "weights.pth"
    torch.save({f"fc.{name}": value for name, value in layers.state_dict().items()}, file)
    state = np.array([1.0, -2.0, 3.0, 0.5])
    expected = layers(torch.tensor(state, dtype=torch.float32)).detach().numpy()
    assert np.allclose(network_of(file).values(state), expected, atol=1e-5)


def test_without_a_clone_it_says_what_to_clone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GARL_FOREIGN", str(tmp_path))
    published_network.cache_clear()
    with pytest.raises(ForeignCodeError, match=r"Clone https://github.com/lfeng0722/drone_testing"):
        Published()
