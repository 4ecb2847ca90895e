"""The cause in a signature, and the ending, which is the signature without it.

Most signatures say how a flight ended and not why: a landing that is given up in plain sight may be
given up for dim light or for a nose to the south.  If exactly one condition acted in the flight, it
ends the signature: ``II:gave-up-in-sight:search:light``.  So two mistakes with one ending are two
kinds once shrinking has left what each takes.  A flight in which several conditions act says
nothing of its cause.  Flights are compared by their endings: a flight with three conditions that is
shrunk to one keeps its ending.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from pytest_garl.scenarios.groups import GROUPS, WEATHER_CAUSES


def _cause(condition: str) -> str:
    """Return what a signature calls a condition: the number of a decoy is a scenario's own."""
    return re.sub(r"-\d+$", "", condition)


CAUSES = frozenset(_cause(each) for each in (*WEATHER_CAUSES, *GROUPS))
"""Names of conditions; no phase of a landing and nothing else that ends a signature has one."""
NAMED_BY_THEMSELVES = ("III", "IV", "V", "abort", "own")
"""Types whose signature names the cause: a body, an exception, an excuse, a test."""
DECOY = "I:decoy"
"""Begins the signature of a landing on a decoy, which is the cause."""
MISTAKES = (DECOY, "slid:", "late:standing", "late:never-gave-up")
"""Begin the signatures that say what the system mistook, or failed to do."""


def names_its_cause(ending: str) -> bool:
    """Return whether an ending says what caused it."""
    return ending.partition(":")[0] in NAMED_BY_THEMSELVES or ending.startswith(MISTAKES)


def with_cause(ending: str, conditions: Sequence[str], objects: Collection[object]) -> str:
    """Return the signature of a flight in which these conditions acted among these objects."""
    if not ending or names_its_cause(ending) or len(conditions) != 1 or objects:
        return ending
    return f"{ending}:{_cause(conditions[0])}"


def ending_of(signature: str) -> str:
    """Return a signature without the condition that ends it."""
    before, _, last = signature.rpartition(":")
    return before if last in CAUSES and not names_its_cause(signature) else signature
