"""Shrinking: the simplest scenario that still fails in the same way.

Simpler means fewer objects, fewer genes off nominal, nearer to nominal, and numbers with fewer
digits.  The first pass is cheap: it removes the objects that the failure does not need, resets
genes to nominal, in halves if all together are too many, and moves the remaining genes nearer to
nominal by bisection.  The second pass is Hypothesis's shrinker on whole steps from nominal, which
finds genes that can only be lowered together.  The third rounds the values.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from hypothesis import HealthCheck, Phase, Verbosity, given, seed, settings
from hypothesis import strategies as st
from hypothesis.database import ExampleDatabase, choices_to_bytes

from pytest_garl.regressions.simplification import (
    OBJECT_PLACES,
    BudgetSpentError,
    Simplification,
    Trials,
    simplifications,
    simplified,
)
from pytest_garl.scenarios.genes import NuclearGene, Property
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


STEPS = 20
"""Steps from nominal to the end of a gene's range: a twentieth is easy to read and to compare."""


class _Variable(NamedTuple):
    """One thing that the shrinker may lower: how to apply a step, all steps, the present step."""

    apply: Callable[[Scenario, int], Scenario]
    steps: st.SearchStrategy[int]
    present: int


class _OneExampleDatabase(ExampleDatabase):
    """Holds one failing input, in the secondary part: Hypothesis takes the primary for shrunk."""

    def __init__(self, choices: bytes) -> None:
        super().__init__()
        self._choices = choices

    def fetch(self, key: bytes) -> Iterable[bytes]:
        return [self._choices] if key.endswith(b".secondary") else []

    def save(self, key: bytes, value: bytes) -> None:
        """Keep nothing: the trials remember the simplest scenario."""

    def delete(self, key: bytes, value: bytes) -> None:
        """Keep the input."""


def shrink_by_hypothesis(trials: Trials, colliding_object: str) -> None:
    """Let Hypothesis shrink the failing scenario as whole steps from nominal.

    Hypothesis takes the failing input from the example database.
    """
    first = trials.best
    variables = list(_variables(trials, colliding_object))
    start = [variable.present for variable in variables]

    def build(steps: Sequence[int]) -> Scenario:
        scenario = first
        for variable, step in zip(variables, steps, strict=True):
            scenario = variable.apply(scenario, step)
        return scenario

    @settings(
        database=_OneExampleDatabase(choices_to_bytes(start)),
        max_examples=100_000,
        phases=(Phase.reuse, Phase.shrink),
        deadline=None,
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
        print_blob=False,
        verbosity=Verbosity.quiet,
    )
    @seed(0)
    @given(st.tuples(*(variable.steps for variable in variables)))
    def test(steps: tuple[int, ...]) -> None:
        with contextlib.suppress(BudgetSpentError):
            # After the last flight nothing new fails, and Hypothesis ends.
            assert not trials(build(steps))

    with contextlib.suppress(AssertionError):
        # The failure is known; the trials remember the simplest scenario.
        test()


def _variables(trials: Trials, colliding_object: str) -> Iterator[_Variable]:
    """Yield the presence of each object but the one that was hit, and each gene off nominal."""
    first = trials.best
    present = {key for key, _ in first.genes}
    for key in sorted(key for key in present if key.endswith(".velocity")):
        name = key.partition(".")[0]
        if name != colliding_object:
            yield _Variable(_presence(name), st.integers(0, 1), 1)
    for gene in trials.genome.genes:
        yield from _genes_off_nominal(gene, first, present)


def _presence(name: str) -> Callable[[Scenario, int], Scenario]:
    return lambda scenario, step: scenario if step else scenario.without(name)


def _genes_off_nominal(
    gene: NuclearGene, first: Scenario, present: set[str]
) -> Iterator[_Variable]:
    for item in gene.properties:
        if item.key not in present or item.key.endswith(OBJECT_PLACES):
            continue
        value = first[item.key]
        if value == item.nominal:
            continue
        end = item.high if value > item.nominal else item.low
        step = max(1, round(STEPS * (value - item.nominal) / (end - item.nominal)))
        yield _Variable(_stepped(item, end, step, value), st.integers(0, STEPS), step)


def _stepped(
    item: Property, end: float, first: int, value: float
) -> Callable[[Scenario, int], Scenario]:
    """Return how to put a gene on a step; the first one is its present value, to the bit."""

    def apply(scenario: Scenario, step: int) -> Scenario:
        if all(key != item.key for key, _ in scenario.genes):
            return scenario
        on_grid = item.nominal + step / STEPS * (end - item.nominal)
        return scenario.replace({item.key: value if step == first else on_grid})

    return apply
