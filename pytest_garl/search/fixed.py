"""Scenarios that are given: a repeated one, or those of saved cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_garl.execution.flight_id import Slot
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario


class FixedScenarios:
    """Proposes each given scenario in its slot, and one of them in every other slot."""

    learns = False
    overlaps = False

    def __init__(self, scenarios: Mapping[Slot, Scenario]) -> None:
        self._scenarios, self._generation = scenarios, -1

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation, up to the highest index of all slots."""
        self._generation += 1
        first = next(iter(self._scenarios.values()))
        size = 1 + max(slot.index for slot in self._scenarios)
        slots = [Slot(generation=self._generation, index=index) for index in range(size)]
        return [self._scenarios.get(slot, first) for slot in slots]

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Learn nothing."""
        return ()
