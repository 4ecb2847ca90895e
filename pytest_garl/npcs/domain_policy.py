"""The NPC policies that domains name: a domain says who moves persons, dogs and birds."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.errors import ScenarioError
from pytest_garl.messages import shown
from pytest_garl.npcs.policy_catalogue import policy_names
from pytest_garl.scenarios.domains.domain import ABSENT, Domain
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.story import GRADES

GRADED = "graded"
"""The policy of scenarios in which each NPC has a grade of its own."""
READ_STORIES = (GRADED, *GRADES[:-1])
"""The policies whose NPCs begin as their stories say.  A hostile NPC attacks from the start."""
NOBODY = "stationary"
"""The policy of scenarios without NPCs, which has nobody to move."""


def domain_with_policy(text: str, folder: Path | None = None) -> Domain:
    """Return a domain by its name or from a TOML file, relative to ``folder``.

    Raises ScenarioError that names the file and the key, also for a behaviour that no NPC policy
    has.
    """
    domain = domain_named(text, folder)
    known = (ABSENT, *policy_names())
    if domain.npc_behaviour not in known:
        source = str((folder or Path()) / text) if text.endswith(".toml") else f"domain {text!r}"
        raise ScenarioError(
            f"{source}: key 'npc_behaviour': found {shown(domain.npc_behaviour)}, expected one of "
            f"{', '.join(known)}"
        )
    return domain


def policy_in(domain: Domain, in_paper: str) -> str:
    """Return the name of the NPC policy of a domain.

    In the world of the paper each search method has a policy of its own: ``in_paper``.
    """
    if domain.paper:
        return in_paper
    if domain.npc_behaviour == ABSENT:
        return NOBODY
    return GRADED if domain.npc_behaviour in GRADES else domain.npc_behaviour
