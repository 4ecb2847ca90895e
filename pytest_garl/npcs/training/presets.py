"""The settings of ``garl train`` and the presets of the shipped policies, without PyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from pytest_garl.landing_system import Airframe
from pytest_garl.scenarios.maps.map import Map

Uav = Literal["straight", "avoiding", "both"]
Reward = Literal["collision-first", "paper"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Training:
    """All hyper-parameters, with the paper's values where it gives any (supplement, table 1)."""

    seed: int = 0
    episodes: int = 800
    hidden: tuple[int, ...] = (24, 24)
    learning_rate: float = 1e-3
    epsilon: float = 0.99
    epsilon_least: float = 0.01
    epsilon_decay: float = 0.995
    """Per episode."""
    discount: float = 0.99
    batch: int = 64
    replay: int = 50_000
    warm_up: int = 500
    """Decisions before the first update."""
    target_every: int = 500
    """Updates after which the target network becomes a copy of the network."""
    double: bool = True
    updates: int = 1
    """Updates after each decision."""
    steps: int = 3
    """n of the n-step returns: rewards that are summed before the network estimates the rest."""
    environments: int = 2
    """Episodes flown at the same time, each in its own process."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Surrogate:
    """The environment of a training: maps, types of NPCs, UAV, state, reward.

    ``uav`` is "straight" (as in the paper), "avoiding", or "both", each in half of the episodes.
    ``discount`` is part of the potential-based reward.  With ``environment`` "drawn" an episode
    begins in any weather and light of a search and with the marker anywhere; with "clear" it begins
    in clear weather with the marker at a fixed place.  With ``grades`` an NPC perceives the UAV
    within the limits of one of them, drawn anew, and its episode begins in the air near the marker,
    but for a share ``takes_off`` that begins with the take-off.
    """

    maps: tuple[Map, ...]
    types: tuple[str, ...] = ("person", "dog", "bird")
    uav: Uav = "avoiding"
    state: str = "relative"
    reward: Reward = "collision-first"
    discount: float = 0.99
    environment: Literal["clear", "drawn"] = "clear"
    grades: tuple[str, ...] = ()
    takes_off: float = 0.0
    airframe: Airframe = field(default_factory=Airframe)


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """How a shipped policy was trained; ``garl train`` fills in the maps.

    ``help`` ends a sentence that begins with "The policy learns".
    """

    help: str
    surrogate: Surrogate
    training: Training


def _graded(*grades: str) -> Preset:
    """Return the preset of a policy that interferes within the limits of grades."""
    return Preset(
        help=f"to collide with a UAV that avoids or not, within the limits of {grades[0]} NPCs",
        surrogate=Surrogate(
            maps=(),
            types=("person", "child", "dog", "bird"),
            uav="both",
            state="belief",
            grades=grades,
        ),
        # Episodes are short, so that each decision is learned from more often.
        training=Training(updates=4),
    )


PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        "dqn": Preset(
            help="to collide with a UAV that avoids what it sees",
            surrogate=Surrogate(
                maps=(), uav="avoiding", state="relative", reward="collision-first"
            ),
            training=Training(),
        ),
        "dqn-paper": Preset(
            help="by the paper's state and reward, against a UAV that flies straight down",
            surrogate=Surrogate(maps=(), uav="straight", state="paper", reward="paper"),
            training=Training(double=False, steps=1),
        ),
        "online-rl": Preset(
            help="to change weather and light as well, like the paper's Online RL",
            surrogate=Surrogate(
                maps=(), uav="straight", state="online", reward="paper", environment="drawn"
            ),
            training=Training(double=False, steps=1),
        ),
        **{name: _graded(name) for name in ("curious", "chasing")},
        "director": Preset(
            help="when NPCs that chase the UAV, or are curious, begin",
            surrogate=Surrogate(
                maps=(),
                types=("person", "child", "dog", "bird"),
                uav="both",
                state="waiting",
                # Most of what a director is worth lies in those that chase.
                grades=("chasing", "chasing", "chasing", "curious"),
                takes_off=0.25,
            ),
            training=Training(learning_rate=2e-3, discount=1.0, episodes=160, steps=1),
        ),
    }
)
