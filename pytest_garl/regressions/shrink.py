"""Shrinking: the simplest scenario that still fails in the same way.

Simpler means fewer objects, fewer genes off nominal, nearer to nominal, and numbers with fewer
digits.  The first pass is cheap: it removes the objects that the failure does not need, resets
genes to nominal, in halves if all together are too many, and moves the remaining genes nearer to
nominal by bisection.  The second pass is Hypothesis's shrinker on whole steps from nominal, which
finds genes that can only be lowered together.  The third rounds the values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pytest_garl.regressions.simplification import (
    OBJECT_PLACES,
    BudgetSpentError,
    Simplification,
    Trials,
    simplifications,
    simplified,
)
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario

BISECTIONS = 3
"""Flights that bring one gene nearer to nominal: to an eighth of its distance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shrunk:
    """Every scenario that failed on the way, from the first to the simplest, and the flights."""

    history: tuple[Scenario, ...]
    flights: int

    @property
    def simplest(self) -> Scenario:
        """The last of them."""
        return self.history[-1]


def shrink(
    first: Scenario,
    fails: Callable[[Scenario], bool],
    map: Map,
    budget: int,
    *,
    colliding_object: str = "",
    passes: Sequence[Callable[[Trials, str], None]] | None = None,
) -> Shrunk:
    """Return the simplest scenario found with at most ``budget`` flights.

    ``first`` is known to fail; ``colliding_object`` is never removed.
    """
    trials = Trials(first, fails, map, budget)
    try:
        for each in (
            (reset_and_bisect, shrink_by_hypothesis, round_values) if passes is None else passes
        ):
            each(trials, colliding_object)
    except BudgetSpentError:
        pass
    return Shrunk(history=tuple(trials.history), flights=trials.flights)


def reset_and_bisect(trials: Trials, colliding_object: str) -> None:
    """Reset as much as the failure survives, in the largest pieces; bisect the rest."""
    groups = simplifications(trials.best, trials.genome, colliding_object)
    everything = [step for group in groups for step in group]
    if len(groups) > 1 and trials(simplified(trials.best, everything)):
        return _bisect(trials)
    for group in groups:
        _reset(trials, group)
    return _bisect(trials)


def round_values(trials: Trials, colliding_object: str) -> None:
    """Write values with as few digits as the failure survives."""
    for digits in (2, 3, 4):
        rounded = {key: round(value, digits) for key, value in trials.best.genes}
        if trials(trials.best.replace(rounded)):
            return


def _reset(trials: Trials, steps: Sequence[Simplification]) -> None:
    """Apply as many simplifications as the failure survives."""
    if trials(simplified(trials.best, steps)) or len(steps) == 1:
        return
    middle = len(steps) // 2
    _reset(trials, steps[:middle])
    _reset(trials, steps[middle:])


def _bisect(trials: Trials) -> None:
    """Bring genes as near to nominal as the failure survives."""
    for gene in trials.genome.genes:
        start = trials.best
        present = {key for key, _ in start.genes}
        moved = [
            item
            for item in gene.properties
            if item.key in present
            and not item.key.endswith(OBJECT_PLACES)
            and start[item.key] != item.nominal
        ]
        if not moved:
            continue
        least, most = 0.0, 1.0
        for _ in range(BISECTIONS):
            share = (least + most) / 2
            near = {i.key: i.nominal + share * (start[i.key] - i.nominal) for i in moved}
            if trials(trials.best.replace(near)):
                most = share
            else:
                least = share


def shrink_by_hypothesis(trials: Trials, colliding_object: str) -> None:
    """Lower whole steps from nominal together, with Hypothesis's shrinker."""
    # Hypothesis takes half a second to import, and most sessions shrink nothing.
    from pytest_garl.regressions.step_shrinking import shrink_steps

    shrink_steps(trials, colliding_object)
