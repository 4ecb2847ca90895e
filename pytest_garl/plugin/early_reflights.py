"""Repeat flights, requested as soon as it is known what fails: idle workers fly them meanwhile."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pytest_garl.execution.first_violations import FirstViolations

if TYPE_CHECKING:
    from pytest_garl.plugin.run import Run
    from pytest_garl.plugin.target import Target

REFLIGHTS = 4
"""A violation of a system that need not be deterministic is flown so many times more."""


class EarlyReflights:
    """Requests the flights that will confirm the first violation of each signature.

    The test that fails for it reports when all lower slots have reported, which may be minutes
    later.  Nothing is decided here: a test that asks for the same flights finds them in the ledger.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._violations = FirstViolations(run.ledger.queries)

    def advance(self) -> None:
        """Request the flights for the generations that were flown since this was called last."""
        searches = self._run.searches
        for search in searches.breeders:
            wanted = searches.targets[search]
            # Saved cases may be many, and nothing in them is new.
            if not next(iter(wanted.values())).is_searched:
                continue
            for signature, (first, *_) in self._violations.advance(search).items():
                target = wanted.get(first.id.slot)
                if target is not None and self._is_reported(target, signature):
                    count = 1 if target.deterministic else REFLIGHTS
                    self._run.request_reflights(target, count)

    def _is_reported(self, target: Target, signature: str) -> bool:
        """Whether a test can fail for a violation that no saved case expects."""
        run = self._run
        shown = any(item.shows for item in run.items.get(target.flight, ()))
        return shown and signature not in run.expected_signatures(target)
