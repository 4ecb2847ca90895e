"""The new signatures of searches that still run, found as soon as a generation is flown."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path

from pytest_garl.cases.corpus import Corpus
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import FirstViolations, LedgerFlight
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.triage.known_kinds import KnownCase, KnownKinds


class NewSignatures:
    """Makes a request of each signature that no saved case excuses, generation by generation.

    A request holds the first violations of its signature, so it is the same for any number of
    workers and in a resumed run.  Violations that a known case excuses are left out, as
    ``known_kinds`` says; what their twins say is known after the search.
    """

    def __init__(self, ledger: Ledger, corpus: Corpus, budget: int) -> None:
        self._ledger, self._corpus, self._budget = ledger, corpus, budget
        self._violations = FirstViolations(ledger.queries)
        self._known: dict[str, KnownKinds] = {}

    def advance(self) -> list[CaseRequest]:
        """Return the requests of the generations that were flown since it was called last.

        They are in the order in which they are found: by generation, then by slot.
        """
        found = []
        for search, text in self._ledger.searches():
            known = self.known(search)
            known.advance()
            if new := self._violations.advance(search, functools.partial(_is_new, known)):
                found += self._requests(search, new, parse_job(text))
        return found

    def known(self, search: str) -> KnownKinds:
        """Return the kinds that were known when a search was asked about first."""
        if search not in self._known:
            text = self._ledger.job(search)
            assert text is not None
            job = parse_job(text)
            cases = known_cases(self._ledger, self._corpus, search, job)
            self._known[search] = KnownKinds(self._ledger, search, job, cases)
        return self._known[search]

    def _requests(
        self, search: str, new: Mapping[str, Sequence[LedgerFlight]], job: FlightJob
    ) -> list[CaseRequest]:
        return [
            request_of(search, signature, flights, job, self._budget)
            for signature, flights in new.items()
        ]


def _is_new(known: KnownKinds, flight: LedgerFlight) -> bool:
    """Return whether no known case excuses a violation, as far as its own flight says."""
    if flight.signature not in known:
        return True
    return known.without_twin(flight.result, parse_scenario(flight.scenario)).known is None


def named(search: str, signature: str, number: int) -> str:
    """Return the name of a request: it is part of the keys of its flights."""
    return f"{search} {signature}{f' {number}' if number > 1 else ''}"


def request_of(
    search: str,
    signature: str,
    flights: Sequence[LedgerFlight],
    job: FlightJob,
    budget: int,
    *,
    number: int = 1,
) -> CaseRequest:
    """Return the request for a case of a signature that these flights violate.

    ``number`` counts the requests for this signature, each of another cause.
    """
    folder = Path(job.flights)
    violations = [(each.repeatable, each.completed(folder)) for each in flights]
    return CaseRequest(
        name=named(search, signature, number),
        signature=signature,
        violations=tuple(violations),
        job=job,
        map=job.load_map(),
        budget=budget,
    )


def known_cases(ledger: Ledger, corpus: Corpus, search: str, job: FlightJob) -> list[KnownCase]:
    """Return the cases that were known when a search was asked about first."""
    expected = corpus.expected_cases(job.system.name, job.map)
    names = sorted(entry.path.name for entry, _ in expected)
    noted = ledger.facts.first_known_cases(search, names)
    return [
        KnownCase(name=entry.path.name, case=case)
        for entry, case in expected
        if entry.path.name in noted
    ]


def expected_signatures(
    ledger: Ledger, corpus: Corpus, search: str, job: FlightJob
) -> frozenset[str]:
    """Return the endings that known cases expected when a search was asked about first."""
    return frozenset(each.case.ending for each in known_cases(ledger, corpus, search, job))
