"""What a generation of a search says of its director: the ledger holds it, the summary tells it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectorProgress:
    """How good the director was in a generation, before it learned from it.

    ``npcs`` NPCs could have begun at any time.  By geometry, and by how the landing system responds
    to NPCs that it sees, begins as the learned weights decide were worth ``learned`` in the mean,
    as the weights that ship decide ``shipped``, by the fixed rule ``rule``, and the best ones
    ``best``: 1 is a collision that the system could have prevented.  Of ``seen`` NPCs that the
    system saw coming ``expected`` were expected to meet the UAV, and ``met`` did.
    """

    npcs: int
    learned: float
    shipped: float
    rule: float
    best: float
    seen: int
    expected: float
    met: int


def total(progresses: Iterable[DirectorProgress]) -> DirectorProgress | None:
    """Return what several generations say together; None if no NPC could have begun."""
    found = [each for each in progresses if each.npcs]
    npcs = sum(each.npcs for each in found)
    if not npcs:
        return None

    def mean(worth: str) -> float:
        return math.fsum(getattr(each, worth) * each.npcs for each in found) / npcs

    return DirectorProgress(
        npcs=npcs,
        learned=mean("learned"),
        shipped=mean("shipped"),
        rule=mean("rule"),
        best=mean("best"),
        seen=sum(each.seen for each in found),
        expected=math.fsum(each.expected for each in found),
        met=sum(each.met for each in found),
    )
