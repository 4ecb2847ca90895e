"""The NPC policy whose weights the paper's authors published, a rival of those that ship.

``random with lab.published:Published`` is a method of ``lab.experiment`` that flies random
scenarios among its NPCs.  The repository has no licence, so that nothing of it is here:
``GARL_FOREIGN`` names a folder with a clone, as for ``lab.foreign``.

State and actions are those of its code: all is relative to the marker, in metres, and NPCs begin
once the UAV is 6 m up.  Here they decide every 0.5 s, as the paper says; its code lets each object
wait for the others, and then a second, and lets all stand in the last part of the landing.
"""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from lab.foreign.repository import ForeignCodeError, Repository
from pytest_garl.npcs.encodings import PLACE_SCALE_M, paper
from pytest_garl.npcs.learned import Network
from pytest_garl.simulation.npc_policy import STAY, Move, Situation

WEIGHTS = "agent_q_network_weights.pth"
REPOSITORY = Repository(
    name="lfeng0722/drone_testing",
    commit="a9f3ad21f0b996eb19fcfc858dc8059fa95733a1",
    licence="none",
    paths=(WEIGHTS,),
)
ACTIONS = (STAY, Move(x=1.0, y=0.0), Move(x=-1.0, y=0.0), Move(x=0.0, y=1.0), Move(x=0.0, y=-1.0))
"""Stay, forward, backward, left, right, in the order of its code."""
BEGIN_M = 6.0


class Published:
    """Moves as the published network wants, once the UAV has been 6 m up."""

    def __init__(self, network: Network | None = None) -> None:
        self._network = network or published_network()

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Wait for the UAV."""
        self._has_begun = False

    def decide(self, situation: Situation) -> Move:
        """Take the action of the highest value."""
        self._has_begun |= situation.uav_position_m[2] >= BEGIN_M
        if not self._has_begun:
            return STAY
        return ACTIONS[int(np.argmax(self._network.values(paper(situation) * PLACE_SCALE_M)))]


@functools.cache
def published_network() -> Network:
    """Return the published network; raise ForeignCodeError if there is no clone with it."""
    if REPOSITORY.problem:
        raise ForeignCodeError(REPOSITORY.problem)
    return network_of(REPOSITORY.prepared({}) / WEIGHTS)


def network_of(file: Path) -> Network:
    """Return the network of two layers whose weights PyTorch saved."""
    import torch

    saved = torch.load(file, map_location="cpu", weights_only=True)
    layers = (
        (saved[f"fc.{number}.weight"].double().numpy(), saved[f"fc.{number}.bias"].double().numpy())
        for number in (0, 2)
    )
    return Network(state="paper", layers=tuple(layers))
