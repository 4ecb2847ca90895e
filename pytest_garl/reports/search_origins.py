"""What chance, stratified draws and evolution each found in a search, and how the model did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.result import How, Origin
from pytest_garl.search.model import PROPERTIES, proximities
from pytest_garl.search.operators import Matrix

HOWS: tuple[How, ...] = ("control", "stratified", "bred")

Made = Sequence[tuple[LedgerFlight, Origin]]
"""The flights of a search in order, each with how its scenario was made."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OriginRecord:
    """The flights whose scenarios were made in one way.

    ``kinds`` is how many kinds of violation they show, ``first`` how many of them no earlier flight
    of the search showed.
    """

    how: How
    flights: int
    violating: int
    kinds: int
    first: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelRecord:
    """How well the model predicted the children that were flown.

    ``expected`` is how many of them it expected to violate something, ``violating`` how many did.
    ``error`` is the mean error of their margins, as a share of a safe margin, and
    ``error_of_mean`` that of somebody who always tells the mean of the flights that the model knew.
    """

    flights: int
    expected: float
    violating: int
    error: float
    error_of_mean: float


def origin_records(made: Made) -> tuple[OriginRecord, ...]:
    """Return what the scenarios of each way found; empty if a method does not tell."""
    seen: set[str] = set()
    first = dict.fromkeys(HOWS, 0)
    for flight, origin in made:
        if flight.result.verdict.violation and flight.signature not in seen:
            seen.add(flight.signature)
            first[origin.how] += 1
    found = []
    for how in HOWS:
        own = [flight for flight, origin in made if origin.how == how]
        shown = [each.signature for each in own if each.result.verdict.violation]
        if own:
            found.append(
                OriginRecord(
                    how=how,
                    flights=len(own),
                    violating=len(shown),
                    kinds=len({*shown}),
                    first=first[how],
                )
            )
    return tuple(found)


def model_record(made: Made) -> ModelRecord | None:
    """Return how well the model predicted, None if there is no prediction."""
    near = [proximities(flight.result) for flight, _ in made]
    generations = np.array([flight.id.slot.generation for flight, _ in made])
    means: dict[int, Matrix] = {}
    errors, expected, violating = list[tuple[float, float]](), 0.0, 0
    for (flight, origin), own in zip(made, near, strict=True):
        if origin.fails is None:
            continue
        generation = flight.id.slot.generation
        if generation not in means:
            # What the model knew: it is one generation behind, but for the first children.
            known = np.flatnonzero(generations <= max(0, generation - 2))
            means[generation] = np.mean([near[place] for place in known], axis=0)
        told = np.array([origin.expected[name] for name in PROPERTIES])
        pair = (told, means[generation])
        errors.append((float(np.abs(pair[0] - own).mean()), float(np.abs(pair[1] - own).mean())))
        expected += origin.fails
        violating += flight.result.verdict.violation
    if not errors:
        return None
    error, error_of_mean = np.mean(errors, axis=0)
    return ModelRecord(
        flights=len(errors),
        expected=expected,
        violating=violating,
        error=float(error),
        error_of_mean=float(error_of_mean),
    )
