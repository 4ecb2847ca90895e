"""The second pass of shrinking: whole steps from nominal, lowered by Hypothesis's shrinker.

It finds genes that can only be lowered together.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from hypothesis import HealthCheck, Phase, Verbosity, given, seed, settings
from hypothesis import strategies as st
from hypothesis.database import ExampleDatabase, choices_to_bytes

from pytest_garl.scenarios.genes import NuclearGene
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.simplification import OBJECT_PLACES, BudgetSpentError, Trials

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


def shrink_steps(trials: Trials, colliding_object: str) -> None:
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
    item: Quantity, end: float, first: int, value: float
) -> Callable[[Scenario, int], Scenario]:
    """Return how to put a gene on a step; the first one is its present value, to the bit."""

    def apply(scenario: Scenario, step: int) -> Scenario:
        if all(key != item.key for key, _ in scenario.genes):
            return scenario
        on_grid = item.nominal + step / STEPS * (end - item.nominal)
        return scenario.replace({item.key: value if step == first else on_grid})

    return apply
