"""The plan of an investigation: its steps, the flights that each takes, and those that it keeps.

An investigation turns a violation of a search into a case: a scenario that is as simple as can be
found, that fails again when its objects repeat recorded moves, and of which slightly different
scenarios fail too.  Each flight costs seconds, so it has a budget of some twelve, and the order of
its steps is that of what a reader gains:

1. *Idle conditions* go first: what the landing system never read is no cause.  No flight.
2. A collision: *a straight crossing*.  The body crosses the place of the contact, careless, in
   clear air.  Nothing simpler can hit a UAV.  The window of its entry is measured in place of
   neighbours.
3. A collision that needs more: *a lower grade* of the body, alone, tried downwards.
4. *The bare scenario*: only what was hit, in clear air, with the search's policy, then with the
   recorded moves, then in the conditions that were found.
5. *The scenario as found*, and those of further violations, until all neighbours of one fail.
6. *Shrinking* of the best of these (``shrink.py``).  A failure without a collision begins here,
   because its objects are dropped first of all.
7. *A shorter record* of the moves.
8. *Escapes*: could anybody have prevented the collision?  (``prevention.py``)

A step is left out if fewer flights are left than it takes and keeps.  Every step keeps those for
the scenario as found with its neighbours, so that no violation is lost because a simpler one was
looked for.

An example with twelve flights: a dog is hit.  Three are kept for escapes, nine are left.  The
crossing hits (1).  Its record is flown (1), and its entry is moved by one and two seconds in both
directions (4).  Two attempts confirm an escape (2).  The case took eight flights.

A saved case that is to become simpler begins with its own record, then takes steps 6 to 8: while
its objects repeat their moves and, if that gives nothing simpler, by the search's policy.  A Python
exception or a hang takes two flights: without anything, and as found.

``investigation.py`` takes these steps, with the numbers of flights below.
"""

from __future__ import annotations

from dataclasses import dataclass

NEIGHBOURS = 3
"""Slightly different scenarios that are flown for each case (``robustness.py``)."""
CANDIDATES = 3
"""Violations of a signature that are tried until the neighbours of one fail as well."""
CONFIRM_FLIGHTS = 1 + NEIGHBOURS
"""A scenario with recorded moves, and its neighbours."""
ESCAPE_FLIGHTS = 3
"""Kept from the start if a moving body was hit: two attempts from the latest state with a plan, and
one from the state shortly after the body was observable."""
EXCEPTION_FLIGHTS = 2
"""A Python exception or a hang hardly depends on the scenario: one flight of the scenario without
objects and weather, one of the scenario as found."""
FEWEST_FOR_VIOLATION = 1 + CONFIRM_FLIGHTS + ESCAPE_FLIGHTS
"""The fewest flights that can confirm a violation: one of a straight crossing or of the scenario
without all that the failure should not need, the scenario as found with its neighbours, escapes."""
FEWEST_FOR_SAVED_CASE = 2 + CONFIRM_FLIGHTS + ESCAPE_FLIGHTS
"""The fewest flights that can improve a saved case: one of it as it is, one of a simpler scenario,
that scenario with recorded moves and its neighbours, escapes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """The flights that a step takes at most before it is known to find nothing, and those it keeps.

    ``keeps`` are for the steps after it.
    """

    takes: int
    keeps: int

    @property
    def needs(self) -> int:
        """The flights without which the step is left out."""
        return self.takes + self.keeps


CROSSING = Step(takes=1, keeps=CONFIRM_FLIGHTS)
"""A straight crossing."""
CROSSING_AGAIN = Step(takes=2, keeps=CONFIRM_FLIGHTS)
"""A crossing at another time, and one in the conditions that were found."""
BARE_BY_POLICY = Step(takes=2, keeps=CONFIRM_FLIGHTS)
"""The bare scenario with the search's policy, then with the moves of that flight."""
LOWER_GRADE = Step(takes=1, keeps=BARE_BY_POLICY.needs)
"""The body alone in one lower grade."""
CROSSING_AGAIN_BEFORE_LOWER_GRADE = Step(takes=2, keeps=LOWER_GRADE.needs)
"""The crossings again, of a body that has a lower grade."""
BARE_BY_RECORD = Step(takes=1, keeps=CONFIRM_FLIGHTS)
"""The bare scenario with the moves of the violation."""
AS_FOUND = Step(takes=CONFIRM_FLIGHTS, keeps=0)
"""The first violation as found."""
ANOTHER_AS_FOUND = Step(takes=CONFIRM_FLIGHTS, keeps=FEWEST_FOR_VIOLATION)
"""A further violation is flown only if the best one so far can still be shrunk."""
SHORTER_RECORD = Step(takes=CONFIRM_FLIGHTS, keeps=0)
"""One shorter record."""


def flights_to_shrink_collision(left: int, *, has_moves: bool) -> int:
    """Return how many of the flights that are left shrinking takes: two or more, or none.

    The others confirm the simplest scenario.  If a body moves, a third is for steps back from an
    edge and for a shorter record.
    """
    found = left - CONFIRM_FLIGHTS - (left // 3 if has_moves else 0)
    return found if found >= 2 else 0


def flights_to_shrink_without_collision(left: int) -> int:
    """Return how many of the flights that are left shrinking takes.

    The simplest scenario may sit on an edge, and a step back has neighbours as well.
    """
    return max(0, left - 2 * NEIGHBOURS)


def flights_to_shrink_saved_case(left: int, *, is_last: bool) -> int:
    """Return how many of the flights that are left shrinking takes.

    The others confirm the simplest scenario and, if many are left, a shorter record.  If this is
    not the last attempt, half is for the next one.
    """
    kept = CONFIRM_FLIGHTS if left < 4 * CONFIRM_FLIGHTS else 2 * CONFIRM_FLIGHTS
    return max(0, left - kept) // (1 if is_last else 2)
