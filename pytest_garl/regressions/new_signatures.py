"""The new signatures of searches that still run, found as soon as a generation is flown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pytest_garl.execution.first_violations import FirstViolations
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.regressions.case_request import CaseRequest
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.scenarios.files import parse_scenario

EXPECTED = "signatures expected before the search "
"""Prefix of the ledger's facts: by search, the signatures that a saved case expected when they were
asked for first.  Cases are saved later, and a run that is resumed after some of them were saved has
the same new signatures."""


class NewSignatures:
    """Makes a request of each signature that no saved case expects, generation by generation.

    A request holds the first violations of its signature, so it is the same for any number of
    workers and in a resumed run.
    """

    def __init__(self, ledger: Ledger, corpus: Corpus, budget: int) -> None:
        self._ledger, self._corpus, self._budget = ledger, corpus, budget
        self._violations = FirstViolations(ledger.queries)

    def advance(self) -> list[CaseRequest]:
        """Return the requests of the generations that were flown since it was called last.

        They are in the order in which they are found: by generation, then by slot.
        """
        found = []
        for search, text in self._ledger.searches():
            if new := self._violations.advance(search):
                found += self._requests(search, new, parse_job(text))
        return found

    def _requests(
        self, search: str, new: Mapping[str, Sequence[LedgerFlight]], job: FlightJob
    ) -> list[CaseRequest]:
        """Return the requests of the new signatures that no saved case expects."""
        expected = expected_signatures(self._ledger, self._corpus, search, job)
        return [
            request_of(search, signature, flights, job, self._budget)
            for signature, flights in new.items()
            if signature not in expected
        ]


def request_of(
    search: str, signature: str, flights: Sequence[LedgerFlight], job: FlightJob, budget: int
) -> CaseRequest:
    """Return the request for a case of a signature that these flights violate."""
    folder = Path(job.flights)
    violations = [(parse_scenario(each.scenario), each.completed(folder)) for each in flights]
    return CaseRequest(
        name=f"{search} {signature}",
        signature=signature,
        violations=tuple(violations),
        job=job,
        map=job.load_map(),
        budget=budget,
    )


def expected_signatures(
    ledger: Ledger, corpus: Corpus, search: str, job: FlightJob
) -> frozenset[str]:
    """Return the signatures that saved cases expected when a search was asked about first."""
    key = f"{EXPECTED}{search}"
    noted = ledger.fact(key)
    if noted is None:
        expected = corpus.expected_signatures(job.system.name, job.map)
        noted = ledger.first_fact(key, sorted(expected))
    return frozenset(noted)
