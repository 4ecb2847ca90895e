"""After a search: all that may become a case, the most frequent first."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from pytest_garl.cases.corpus import Corpus
from pytest_garl.cases.user_failure import UserAssertion
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.triage.new_signatures import expected_signatures, request_of
from pytest_garl.triage.second_reading import finding_requests

SearchSignature = tuple[str, str]
"""The key of a search and a signature."""


def case_requests(
    ledger: Ledger,
    corpus: Corpus,
    budget: int,
    discovered: Sequence[CaseRequest],
    assertions: Mapping[SearchSignature, UserAssertion],
) -> tuple[CaseRequest, ...]:
    """Return the requests of each search, those of the most frequent signatures first.

    ``discovered`` are those for violations of built-in properties.  ``assertions`` of users' tests
    failed in flights without such a violation.  Behind them stand requests for what had gone wrong
    before the end of flights.  ``budget`` limits the flights of each.
    """
    requests: list[CaseRequest] = []
    jobs = {search: parse_job(text) for search, text in ledger.searches()}
    # All are written down before the first case is saved, which another search may expect.
    expected = {each: expected_signatures(ledger, corpus, each, job) for each, job in jobs.items()}
    for search, job in jobs.items():
        count = Counter(flight.signature for flight in ledger.queries.violating(search))
        own = [each for each in discovered if each.search == search]
        for signature in (each for of, each in assertions if of == search):
            assertion = assertions[search, signature]
            if signature not in expected[search]:
                own += _requests_of_assertion(ledger, search, signature, assertion, job, budget)
        requests += sorted(
            own,
            key=lambda each: (-(count[each.signature] or len(each.violations)), each.signature),
        )
    return (*requests, *finding_requests(ledger, expected, budget))


def _requests_of_assertion(
    ledger: Ledger,
    search: str,
    signature: str,
    assertion: UserAssertion,
    job: FlightJob,
    budget: int,
) -> list[CaseRequest]:
    """Return the request for a test's own assertion.

    None if it fails only in flights that violate something else as well.
    """
    folder = Path(job.flights)
    flights = [
        flight
        for flight in ledger.queries.flights(search)
        if assertion(flight.completed(folder), parse_scenario(flight.scenario))
    ]
    if not flights:
        return []
    request = request_of(search, signature, flights, job, budget)
    return [dataclasses.replace(request, user_assertion=assertion)]
