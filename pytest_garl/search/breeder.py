"""Adds the generations of a search to the ledger, each as soon as its parents are flown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.search.method import FlownScenario, Method, TellsOrigins
from pytest_garl.search.teaching import Lessons


class Breeder:
    """Runs the method of one search; all pytest processes of a run compute the same scenarios.

    ``wanted`` has the slots to fly of each generation.  A method that learns needs all slots of
    every generation but the last.  ``lessons`` train the director of the search, if it has one.
    """

    def __init__(
        self,
        ledger: Ledger,
        search: str,
        method: Method,
        wanted: Mapping[int, Sequence[int]],
        lessons: Lessons | None = None,
    ) -> None:
        self._ledger, self._search, self._method = ledger, search, method
        self._wanted = dict(wanted)
        self._lessons = lessons
        self._last_generation = max(wanted)
        self._next_generation = 0
        self._next_told = 0
        """The first generation of which the method knows no results."""

    def advance(self) -> None:
        """Add every generation whose parents are flown to the ledger."""
        while self._next_generation <= self._last_generation and self._parents_are_flown():
            self._learn()
            scenarios = self._method.ask()
            slots = self._wanted.get(self._next_generation, ())
            if self._method.learns and self._next_generation < self._last_generation:
                slots = range(len(scenarios))
            if isinstance(self._method, TellsOrigins) and self._method.origins:
                self._ledger.facts.note_origins(
                    self._search, self._next_generation, self._method.origins
                )
            if self._lessons is not None and self._lessons.director:
                self._ledger.facts.note_director(
                    self._search, self._next_generation, self._lessons.director
                )
            texts = {slot: dump_scenario(scenarios[slot]) for slot in slots}
            self._ledger.add_slots(self._search, self._next_generation, texts)
            self._next_generation += 1

    @property
    def _parents(self) -> int:
        """The generation that the next one needs the results of; negative if there is none.

        A method that overlaps is one generation behind, but for the second generation: without the
        results of the first it would have nothing to breed from.
        """
        if not self._method.learns or self._next_generation == 0:
            return -1
        return max(0, self._next_generation - (2 if self._method.overlaps else 1))

    def _parents_are_flown(self) -> bool:
        return self._parents < 0 or self._ledger.queries.unflown(self._search, self._parents) == 0

    def _learn(self) -> None:
        while self._next_told <= self._parents:
            generation = self._ledger.generation(self._search, self._next_told)
            flown = [
                FlownScenario(scenario=parse_scenario(text), result=result)
                for text, result in generation
                if result is not None
            ]
            objectives = self._method.tell(flown)
            self._ledger.note_objectives(self._search, self._next_told, objectives)
            if self._lessons is not None:
                progress = self._lessons.learn(self._next_told, generation)
                self._ledger.facts.note_progress(self._search, self._next_told, progress)
            self._next_told += 1
