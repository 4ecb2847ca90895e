"""Which failing items of a session known cases excuse; ``known_kinds`` has the rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pytest_garl.execution.job import parse_job
from pytest_garl.regressions.known_kinds import Excuse, KnownCase, KnownKinds

if TYPE_CHECKING:
    from pytest_garl.plugin.run import Run
    from pytest_garl.plugin.target import Target

NOTHING_KNOWN = Excuse(known=None)


class KnownViolations:
    """Asks the committed and accepted cases; each process of a session comes to the same answer."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._kinds: dict[str, KnownKinds] = {}

    def excuse(self, target: Target, ending: str) -> Excuse:
        """Return the case that excuses a violation in a flown slot of a search, or why none does.

        Waits for the slot's generation, and for the twin of the kind.  A repeated scenario is
        excused by none, because the user wants to see it fail.
        """
        if self._run.options.repeat:
            return NOTHING_KNOWN
        kinds = self._of(target)
        if ending not in kinds:
            return NOTHING_KNOWN
        self._wait_for_generation(kinds, target.slot.generation)
        result = self._run.flight(target).result
        excuse = kinds.without_twin(result, self._run.scenario(target))
        if excuse.known is None:
            return excuse
        twin = kinds.twin(ending)
        if twin is None:
            return excuse
        if kinds.is_refuted(ending, twin, self._run.wait(twin.flight).result):
            reason = f"the search's first violation of the kind fails without {twin.cause.text} too"
            return Excuse(known=None, reason=reason)
        return excuse

    def files(self, target: Target, ending: str) -> str:
        """Return the files of the known cases of an ending, for a text."""
        return ", ".join(self._of(target).files(ending))

    def _of(self, target: Target) -> KnownKinds:
        if target.search not in self._kinds:
            run = self._run
            text = run.ledger.job(target.search)
            assert text is not None
            expected = run.options.corpus.expected_cases(
                target.system_name, target.map, accepted=True
            )
            known = [KnownCase(name=entry.path.name, case=case) for entry, case in expected]
            self._kinds[target.search] = KnownKinds(
                run.ledger, target.search, parse_job(text), known
            )
        return self._kinds[target.search]

    def _wait_for_generation(self, kinds: KnownKinds, generation: int) -> None:
        kinds.advance()
        while not kinds.is_closed(generation):
            self._run.turn()
            kinds.advance()
