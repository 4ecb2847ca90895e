"""Rates of bad ends before and after a change, each tested on pairs of flights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pytest_garl.gate.gate_statistics import can_reject, mcnemar_p
from pytest_garl.gate.pairs import Pair


@dataclass(frozen=True, slots=True, kw_only=True)
class RateChange:
    """A rate before and after: ``base`` and ``head`` are numbers of flights.

    ``broke`` counts the tested pairs where only the head has the event, ``fixed`` those where only
    the base has it.  ``p`` is that of :func:`mcnemar_p`; ``adjusted`` is ``p`` after Holm's
    correction, None if too few pairs differ to fail the gate.
    """

    what: str
    base: int
    head: int
    broke: int
    fixed: int
    p: float
    adjusted: float | None = None

    def can_fail(self, level: float) -> bool:
        """Return whether enough pairs differ to fail the gate."""
        return can_reject(self.broke + self.fixed, level)


def rate_changes(pairs: Sequence[Pair]) -> tuple[RateChange, RateChange, RateChange]:
    """Return the changes of violations, of grave violations and of safe aborts, uncorrected.

    Violations are tested on all pairs.  Grave ones, such as collisions, are tested on the pairs in
    which both flights violate: a collision in place of a needless giving up is worse, and the
    reverse is better, though the number of violations stays.  Safe aborts are ends without a
    landing that violate nothing.  They are tested on the pairs without a violation: in place of a
    collision they are an improvement, in place of a landing they are not.
    """
    both = [pair for pair in pairs if pair.base.violated and pair.head.violated]
    neither = [pair for pair in pairs if not (pair.base.violated or pair.head.violated)]
    return (
        _rate_change("violations", "violated", pairs, tested=pairs),
        _rate_change("violations other than no landing", "is_grave", pairs, tested=both),
        _rate_change("safe aborts", "is_safe_abort", pairs, tested=neither),
    )


def _rate_change(
    what: str, event: str, pairs: Sequence[Pair], *, tested: Sequence[Pair]
) -> RateChange:
    """Count an event, a property of :class:`FlightSummary`, and test it; not yet corrected."""
    broke = sum(getattr(pair.head, event) and not getattr(pair.base, event) for pair in tested)
    fixed = sum(getattr(pair.base, event) and not getattr(pair.head, event) for pair in tested)
    return RateChange(
        what=what,
        base=sum(getattr(pair.base, event) for pair in pairs),
        head=sum(getattr(pair.head, event) for pair in pairs),
        broke=broke,
        fixed=fixed,
        p=mcnemar_p(broke, fixed),
    )
