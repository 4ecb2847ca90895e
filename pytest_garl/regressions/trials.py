"""Trials of a shrink: each scenario is flown once, within a budget of flights."""

from __future__ import annotations

from collections.abc import Callable

from pytest_garl.regressions.complexity import complexity, genome_of
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair


class BudgetSpentError(Exception):
    """The budget of flights is spent."""


class Trials:
    """Flies each scenario once, within a budget, and remembers the simplest that failed."""

    def __init__(
        self, first: Scenario, fails: Callable[[Scenario], bool], map: Map, budget: int
    ) -> None:
        self.map, self._fails, self._left = map, fails, budget
        self.genome = genome_of(first, map)
        self._known = {first: True}
        self.history = [first]
        self.flights = 0

    @property
    def best(self) -> Scenario:
        """The simplest scenario that failed."""
        return self.history[-1]

    def __call__(self, scenario: Scenario) -> bool:
        """Return whether a scenario fails; raise BudgetSpentError if no flight is left for it."""
        scenario = repair(scenario, self.map)
        if scenario not in self._known:
            if self._left <= 0:
                raise BudgetSpentError
            self._left -= 1
            self.flights += 1
            self._known[scenario] = self._fails(scenario)
        failed = self._known[scenario]
        if failed and complexity(scenario, self.genome) < complexity(self.best, self.genome):
            self.history.append(scenario)
        return failed
