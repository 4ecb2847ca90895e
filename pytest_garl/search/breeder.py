"""Breeds the generations of a search, each as soon as its parents are flown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.search.method import FlownScenario, Method


class Breeder:
    """One search in one pytest process; all processes of a run breed the same scenarios.

    ``wanted`` are the slots of each generation that are to be flown.  A method that learns needs
    all slots of every generation but the last.
    """

    def __init__(
        self,
        ledger: Ledger,
        search: str,
        method: Method,
        wanted: Mapping[int, Sequence[int]],
    ) -> None:
        self._ledger, self._search, self._method = ledger, search, method
        self._wanted = dict(wanted)
        self._last = max(wanted)
        self._next = 0

    def advance(self) -> None:
        """Put every generation that can be bred now into the ledger."""
        while self._next <= self._last and self._parents_are_flown():
            if self._next > 0:
                self._learn(self._next - 1)
            scenarios = self._method.ask()
            slots = self._wanted.get(self._next, ())
            if self._method.learns and self._next < self._last:
                slots = range(len(scenarios))
            texts = {slot: dump_scenario(scenarios[slot]) for slot in slots}
            self._ledger.add_slots(self._search, self._next, texts)
            self._next += 1

    def _parents_are_flown(self) -> bool:
        if self._next == 0 or not self._method.learns:
            return True
        return self._ledger.unflown(self._search, self._next - 1) == 0

    def _learn(self, generation: int) -> None:
        if not self._method.learns:
            return
        flown = [
            FlownScenario(scenario=parse_scenario(text), result=result)
            for text, result in self._ledger.generation(self._search, generation)
            if result is not None
        ]
        objectives = self._method.tell(flown)
        self._ledger.note_objectives(self._search, generation, objectives)
