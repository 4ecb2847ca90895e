"""The NPC policies by name, without the cost of importing them.

A shipped policy is one file: a module in ``policies/`` that declares ``POLICY``, its class, or
weights (.npz, with their manifest) in ``weights/``.  The policy has the name of the file.

Every pytest run imports this module for ``--help``, so only what the policy in use needs is
imported.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.weights import WEIGHTS

if TYPE_CHECKING:
    from pytest_garl.simulation.npc_policy import PolicySpec

DEFAULT_POLICY = "dqn"


@functools.cache
def scripted_policies() -> tuple[str, ...]:
    """Return the names of the shipped policies that are programmed."""
    files = Path(__file__).with_name("policies").iterdir()
    modules = (file.stem for file in files if file.suffix == ".py" and file.stem != "__init__")
    return tuple(sorted(modules))


@functools.cache
def learned_policies() -> tuple[str, ...]:
    """Return the names of the shipped policies that were trained."""
    return tuple(sorted(file.stem for file in WEIGHTS.iterdir() if file.suffix == ".npz"))


def policy_names() -> tuple[str, ...]:
    """Return the names of all shipped policies."""
    return learned_policies() + scripted_policies()


def policy_spec(name: str) -> PolicySpec:
    """Return the specification of a shipped policy, or of weights in a file.

    Raises PolicyError for an unknown name, and for weights that cannot be trusted.
    """
    if name in scripted_policies():
        from pytest_garl.simulation.npc_policy import PolicySpec

        return PolicySpec(name=name, factory=f"{__package__}.policies.{name}:POLICY")
    if name not in learned_policies() and not name.endswith(".npz"):
        raise PolicyError(
            f"unknown NPC policy {name!r}; expected one of {', '.join(policy_names())}, "
            "or the path of weights (.npz) that `garl train` wrote"
        )
    from pytest_garl.npcs.learned import learned_spec

    return learned_spec(name)
