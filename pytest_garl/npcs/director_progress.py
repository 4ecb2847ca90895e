"""What a generation of a search says of its directors: the ledger has it, the summary tells it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

AND_EVENTS = "|"
"""In a text of weights it stands between those of NPCs and those of events."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a director of events learns of a flight's end: whether it violates, and its worth."""

    violates: bool
    worth: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EventProgress:
    """How good the director of events was in a generation, before it learned from it.

    In ``flights`` flights each kind of event that did not strike could have struck at any time.  By
    what followed strikes in flights of this landing system, strikes as the learned weights decide
    were worth ``learned`` in the mean, by the fixed rule ``rule``, and the best ones ``best``: 1 is
    a violation.  Of ``struck`` events that struck ``expected`` were expected to be followed by a
    violation, and ``violated`` were.
    """

    flights: int
    learned: float
    rule: float
    best: float
    struck: int
    expected: float
    violated: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """What a generation says of both directors, that of NPCs and that of events."""

    npcs: DirectorProgress
    events: EventProgress


def _mean(worths: Iterable[float], counts: Sequence[int]) -> float:
    """Return the mean of what generations say, each as heavy as its count."""
    products = (worth * count for worth, count in zip(worths, counts, strict=True))
    return math.fsum(products) / sum(counts)


def total(progresses: Iterable[DirectorProgress]) -> DirectorProgress | None:
    """Return what several generations say together; None if no NPC could have begun."""
    found = [each for each in progresses if each.npcs]
    counts = [each.npcs for each in found]
    if not counts:
        return None
    return DirectorProgress(
        npcs=sum(counts),
        learned=_mean((each.learned for each in found), counts),
        shipped=_mean((each.shipped for each in found), counts),
        rule=_mean((each.rule for each in found), counts),
        best=_mean((each.best for each in found), counts),
        seen=sum(each.seen for each in found),
        expected=math.fsum(each.expected for each in found),
        met=sum(each.met for each in found),
    )


def total_of_events(progresses: Iterable[EventProgress]) -> EventProgress | None:
    """Return what several generations say together; None if no event struck."""
    found = [each for each in progresses if each.flights]
    counts = [each.flights for each in found]
    if not any(each.struck for each in found):
        return None
    return EventProgress(
        flights=sum(counts),
        learned=_mean((each.learned for each in found), counts),
        rule=_mean((each.rule for each in found), counts),
        best=_mean((each.best for each in found), counts),
        struck=sum(each.struck for each in found),
        expected=math.fsum(each.expected for each in found),
        violated=sum(each.violated for each in found),
    )
