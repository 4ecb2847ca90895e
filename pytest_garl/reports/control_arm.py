"""The control arm of a search: its plain random flights, beside which the later ones stand."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.verdicts.kinds import kinds_in_flights, range_of_kinds

LEAST_FLIGHTS = 20
"""With fewer flights on either side one kind more or less decides the comparison."""


def is_control(method: str | None, generation: int) -> bool:
    """Whether a generation of a method is plain random scenarios of the domain.

    Only ``garl`` has such a control arm: its generation 0.
    """
    return method == "garl" and generation == 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """Some flights of a search, and how many of them show each kind of violation."""

    flights: int
    counts: tuple[int, ...]

    @classmethod
    def of(cls, flights: Sequence[LedgerFlight]) -> Self:
        """Return the arm of these flights.

        Each shows one kind or none: a failed assertion of a user's own is no kind here, because the
        search does not know it.
        """
        shown = Counter(each.signature for each in flights if each.result.verdict.violation)
        return cls(flights=len(flights), counts=tuple(sorted(shown.values(), reverse=True)))

    @property
    def kinds(self) -> int:
        """The number of kinds that the flights show."""
        return len(self.counts)


@dataclass(frozen=True, slots=True, kw_only=True)
class AtEqualFlights:
    """How many kinds each arm shows in ``flights`` flights.

    An arm with more flights shows this many on average, over all ways to draw ``flights`` of them;
    ``random_range`` and ``later_range`` hold 95 % of the draws.
    """

    flights: int
    random: float
    random_range: tuple[int, int]
    later: float
    later_range: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlArm:
    """The random flights of a search, and its later ones."""

    random: Arm
    later: Arm

    @property
    def enough(self) -> bool:
        """Whether both arms have the flights that a comparison takes."""
        return min(self.random.flights, self.later.flights) >= LEAST_FLIGHTS

    @property
    def at_equal_flights(self) -> AtEqualFlights | None:
        """The comparison at the number of flights of the smaller arm; None if too few."""
        if not self.enough:
            return None
        flights = min(self.random.flights, self.later.flights)
        arms = self.random, self.later
        means = [kinds_in_flights(arm.counts, arm.flights, flights) for arm in arms]
        ranges = [range_of_kinds(arm.counts, arm.flights, flights) for arm in arms]
        return AtEqualFlights(
            flights=flights,
            random=means[0],
            random_range=ranges[0],
            later=means[1],
            later_range=ranges[1],
        )


def control_arm(method: str | None, flights: Sequence[LedgerFlight]) -> ControlArm | None:
    """Return the control arm of a search; None if no flight is of one."""
    control = [each for each in flights if is_control(method, each.id.slot.generation)]
    later = [each for each in flights if not is_control(method, each.id.slot.generation)]
    return ControlArm(random=Arm.of(control), later=Arm.of(later)) if control else None
