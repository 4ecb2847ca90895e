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


def names_policy(text: str) -> bool:
    """Whether a text is a name that :func:`policy_spec` takes; what it names may not exist."""
    return text in policy_names() or text.endswith(".npz") or ":" in text


def expected_policies() -> str:
    """Return what names a policy, for help and errors."""
    return (
        f"one of {', '.join(policy_names())}, weights (.npz) that `garl train` wrote, or "
        "'module:class' of an importable module"
    )


def policy_spec(name: str) -> PolicySpec:
    """Return the specification of a shipped policy, of weights in a file, or of a user's class.

    Raises PolicyError for an unknown name, and for weights that cannot be trusted.
    """
    if not names_policy(name):
        raise PolicyError(f"unknown NPC policy {name!r}; expected {expected_policies()}")
    if name in learned_policies() or name.endswith(".npz"):
        from pytest_garl.npcs.learned import learned_spec

        return learned_spec(name)
    from pytest_garl.simulation.npc_policy import PolicySpec

    shipped = name in scripted_policies()
    return PolicySpec(
        name=name, factory=f"{__package__}.policies.{name}:POLICY" if shipped else name
    )
