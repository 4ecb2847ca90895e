"""The risk of a run: how often landings fail in use and where, read once from its ledger."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pytest_garl.cases.corpus import Corpus
from pytest_garl.errors import LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.reports.failure_probability import (
    FailureProbability,
    SamplePart,
    failure_probability,
)
from pytest_garl.reports.failure_regions import (
    FailureRegion,
    failure_region,
    taught_and_held_out,
)
from pytest_garl.reports.failure_rules import LEAST_FAILING, table_of_scenarios
from pytest_garl.reports.run_reading import run_record_of, with_origins
from pytest_garl.reports.run_record import SearchRecord
from pytest_garl.reports.search_origins import Made
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.map import Map

ANY_FAILURE = "any failure"


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchRisk:
    """How often the landings of one landing system fail on a map, and where.

    ``probability`` is None without a sample of use.  ``kinds`` are the rules of all failures and of
    each kind that enough flights show.
    """

    name: str
    flights: int
    failing: int
    inconclusive: int
    probability: FailureProbability | None
    parts: tuple[SamplePart, ...]
    kinds: tuple[FailureRegion, ...]


def read_risks(path: Path, corpus: Corpus) -> tuple[SearchRisk, ...]:
    """Return the risk of each search in the ledger at ``path``; raise LedgerError without one."""
    if not path.is_file():
        raise LedgerError(f"there is no ledger at {path}; run a search first")
    with contextlib.closing(Ledger(path)) as ledger:
        run = run_record_of(ledger, corpus)
        return tuple(
            risk_of(
                search,
                with_origins(ledger.facts, search.flights),
                run.jobs[search.flights[0].id.search].load_map(),
            )
            for search in run.searches
        )


def risk_of(search: SearchRecord, made: Made, map: Map) -> SearchRisk:
    """Return the risk of a search, of whose flights the method may tell how they were made."""
    failing = {slot for kind in search.kinds for slot in kind.slots}
    parts: dict[tuple[float, str], list[bool]] = {}
    for flight, origin in made:
        if origin.share is not None and not flight.result.inconclusive:
            fails = flight.id.slot_id in failing
            parts.setdefault((origin.share, origin.how), []).append(fails)
    sample = tuple(
        SamplePart(how=how, share=share, flights=len(fails), failing=sum(fails))
        for (share, how), fails in sorted(parts.items(), reverse=True)
    )
    return SearchRisk(
        name=search.name,
        flights=search.flown,
        failing=len(failing),
        inconclusive=len(search.inconclusive),
        probability=failure_probability(sample),
        parts=sample,
        kinds=tuple(_regions(search, made, failing, map)),
    )


def _regions(
    search: SearchRecord, made: Made, failing: Set[str], map: Map
) -> Iterator[FailureRegion]:
    flights = [each for each in search.flights if not each.result.inconclusive]
    slots = np.array([each.id.slot_id for each in flights])
    parents: dict[str, Sequence[str]] = {each.id.slot_id: () for each in search.flights}
    parents |= {flight.id.slot_id: origin.parents for flight, origin in made}
    taught, held_out = (np.isin(slots, sorted(each)) for each in taught_and_held_out(parents))
    table = table_of_scenarios([parse_scenario(each.scenario) for each in flights], map)
    shown = {ANY_FAILURE: failing} | {kind.signature: {*kind.slots} for kind in search.kinds}
    for kind, own in shown.items():
        if len(own) >= LEAST_FAILING:
            shows = np.isin(slots, sorted(own))
            yield failure_region(kind, table, shows, taught, held_out)
