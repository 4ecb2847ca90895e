"""What a generation of a search says of its director: the ledger holds it, the summary tells it."""

from __future__ import annotations

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
