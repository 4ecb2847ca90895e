"""Where landings fail: a rule over conditions for each kind of failure, with its error.

A rule is learned from one half of the flights (``failure_rules.py``) and judged on the other half,
which it has never seen.  A hash of the slot's name divides them.  A bred flight has whole
conditions of earlier flights: it never judges a rule, and teaches one only if all flights that it
is bred from do.  A rule that could be as good by chance is none.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.reports.failure_rules import ConditionTable, Mask, learn_rule

LARGEST_CHANCE = 0.05
"""Of chance to be as good on the flights that judge a rule, from which on it is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureRegion:
    """A rule that says where one kind of failure occurs, and how it did on held-out flights.

    ``rule`` is empty if none was found.  Of ``held_out`` flights ``failing`` show the kind; the
    rule covers ``covered`` of them, of which ``hits`` show it.
    """

    kind: str
    rule: str
    held_out: int
    failing: int
    covered: int
    hits: int

    @property
    def precision(self) -> float:
        """The share of the covered flights that show the kind; 0 without any."""
        return self.hits / self.covered if self.covered else 0.0

    @property
    def recall(self) -> float:
        """The share of the flights with the kind that the rule covers; 0 without any."""
        return self.hits / self.failing if self.failing else 0.0


def taught_and_held_out(parents: Mapping[str, Sequence[str]]) -> tuple[set[str], set[str]]:
    """Return the slots from which rules are learned, and those that judge them.

    ``parents`` are the slots that each flight of a search, in order, was bred from.  Flights of
    earlier searches teach: none of them is held out here.
    """
    taught, held_out = set[str](), set[str]()
    for slot, own in parents.items():
        if own:
            if all(each in taught or each not in parents for each in own):
                taught.add(slot)
        elif hashlib.sha256(slot.encode()).digest()[0] % 2:
            held_out.add(slot)
        else:
            taught.add(slot)
    return taught, held_out


def failure_region(
    kind: str, table: ConditionTable, shows: Mask, taught: Mask, held_out: Mask
) -> FailureRegion:
    """Return the rule of a kind that some flights of a table show, each mask of shape (n,)."""
    rule = learn_rule(table.of(taught), shows[taught])
    covers = np.zeros(len(shows), dtype=bool) if rule is None else rule.covers(table.values)
    counts = [
        int(np.count_nonzero(each & held_out))
        for each in (np.ones(len(shows), dtype=bool), shows, covers, shows & covers)
    ]
    is_rule = rule is not None and chance_of(*counts) <= LARGEST_CHANCE
    total, failing, covered, hits = counts
    return FailureRegion(
        kind=kind,
        rule=rule.words if rule is not None and is_rule else "",
        held_out=total,
        failing=failing,
        covered=covered if is_rule else 0,
        hits=hits if is_rule else 0,
    )


def chance_of(total: int, failing: int, covered: int, hits: int) -> float:
    """Return the probability of so many hits or more if the covered flights were drawn by chance.

    It is the tail of the hypergeometric distribution, Fisher's exact test.
    """
    ways = math.comb(total, covered)
    most = min(failing, covered)
    found = sum(
        math.comb(failing, each) * math.comb(total - failing, covered - each)
        for each in range(hits, most + 1)
    )
    return found / ways
