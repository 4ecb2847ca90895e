"""Shrinking: the simplest scenario that still fails in the same way.

Simpler means fewer objects, fewer genes off nominal, nearer to nominal, and numbers with fewer
digits.  The first pass is cheap: it removes the objects that the failure does not need, resets
conditions to nominal, in halves if all together are too many, then single values of those that are
left, and moves what remains nearer to nominal by bisection.  The second pass is Hypothesis's
shrinker on whole steps from nominal, which finds genes that can only be lowered together.  The
third rounds the values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.simplification import (
    OBJECT_PLACES,
    BudgetSpentError,
    Simplification,
    Trials,
    simplifications,
    simplified,
    value_simplifications,
)

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
    """Reset as much as the failure survives, in the largest pieces; bisect the rest.

    The object that was hit may be enough for a failure.  A failure without such an object
    needs a condition; if it needs none, the end of a bisection shows it.
    """
    steps = simplifications(trials.best, trials.genome, colliding_object)
    is_hit = bool(colliding_object)
    if is_hit and trials(simplified(trials.best, steps.all)):
        return _bisect(trials)
    needs_no_object = _reset(trials, steps.objects)
    _reset(trials, steps.conditions, needs_one=needs_no_object or not is_hit)
    for values in value_simplifications(trials.best, trials.genome).values():
        _reset(trials, values, needs_one=True)
    return _bisect(trials)


def round_values(trials: Trials, colliding_object: str) -> None:
    """Write values with as few digits as the failure survives."""
    for digits in (2, 3, 4):
        rounded = {key: round(value, digits) for key, value in trials.best.genes}
        if trials(trials.best.replace(rounded)):
            return


def _reset(trials: Trials, steps: Sequence[Simplification], *, needs_one: bool = False) -> bool:
    """Apply as many simplifications as the failure survives; return whether it survives all.

    If the failure needs at least one, which may be known, all together are not tried.
    """
    if not steps:
        return True
    if not needs_one and trials(simplified(trials.best, steps)):
        return True
    if len(steps) == 1:
        return False
    middle = len(steps) // 2
    survived = _reset(trials, steps[:middle])
    return _reset(trials, steps[middle:], needs_one=survived) and survived


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
        for step in range(BISECTIONS):
            # A failure that survives two halvings may not need the value at all.
            if step == BISECTIONS - 1 and least == 0 and trials(_nearer(start, moved, 0.0)):
                break
            share = (least + most) / 2
            if trials(_nearer(start, moved, share)):
                most = share
            else:
                least = share


def _nearer(scenario: Scenario, items: Sequence[Quantity], share: float) -> Scenario:
    """Return a scenario whose genes have only a share of their distance from nominal."""
    near = {each.key: each.nominal + share * (scenario[each.key] - each.nominal) for each in items}
    return scenario.replace(near)


def shrink_by_hypothesis(trials: Trials, colliding_object: str) -> None:
    """Lower whole steps from nominal together, with Hypothesis's shrinker."""
    # Hypothesis takes half a second to import, and most sessions shrink nothing.
    from pytest_garl.shrinking.step_shrinking import shrink_steps

    shrink_steps(trials, colliding_object)
