"""The state of a run in one pytest process: options, ledger, pool, flights and findings."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import pytest

from pytest_garl.cases.reference_proofs import Proofs, proves_reference
from pytest_garl.cases.replay import SourceHashes, stale_reasons
from pytest_garl.errors import LedgerError
from pytest_garl.execution.facts import Facts, SearchKey
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, Slot
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import FirstViolations
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.pool import Pool, wait_for
from pytest_garl.execution.reference import Reference, simulator_sha256
from pytest_garl.execution.sources import combined_sha256
from pytest_garl.plugin.items.keys import target_of
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.session.search_setup import Searches
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.archive import Archive
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.triage.known_kinds import KnownCase, KnownCaseMatch, KnownKinds

if TYPE_CHECKING:
    from pytest_garl.cases.corpus import Corpus
    from pytest_garl.plugin.items.user_assertions import ItemAssertion
    from pytest_garl.triage.follow_up import InvestigatedSignature
    from pytest_garl.triage.forecast import RemainingWork
    from pytest_garl.triage.investigation_queue import Investigations

REFLIGHTS = 4
"""A violation of a system that need not be deterministic is flown this many times more."""
NOTHING_KNOWN = KnownCaseMatch(known=None)
FilmKey = tuple[str, ...]
"""What a film shows: (name of its search, signature) of a kind, or (name,) of a saved case."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectedItem:
    """A selected test item of a slot.

    ``test`` is the same for all slots of one test.  ``shows`` says whether pytest reports its
    failure: the item has no mark that skips it or lets it fail, and it takes the slot's landing.
    """

    nodeid: str
    test: str
    shows: bool
    item: pytest.Item


def selected(item: pytest.Item) -> SelectedItem:
    """Return what a run keeps of an item."""
    marked = any(item.get_closest_marker(name) for name in ("skip", "skipif", "xfail"))
    return SelectedItem(
        nodeid=item.nodeid,
        test=test_of(item),
        shows=not marked and "landing" in getattr(item, "fixturenames", ()),
        item=item,
    )


def test_of(item: pytest.Item) -> str:
    """Return an item's test with its parameters but the slot."""
    callspec, target = getattr(item, "callspec", None), target_of(item)
    # Not pytest's indices of the parameters, which count all items of the test.
    others = callspec.id.replace(target.name, "", 1).strip("-") if callspec and target else ""
    name = f"{item.nodeid.removesuffix(item.name)}{getattr(item, 'originalname', item.name)}"
    return f"{name}[{others}]" if others else name


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportClaims:
    """Lets an item claim a slot or a failure that several items find, and notes which items ran.

    The claims are facts of the ledger, so that all processes of a session agree.  ``Ledger`` drops
    them when a run is resumed, because its tests run again.
    """

    facts: Facts

    def claim_slot(self, target: Target, nodeid: str) -> bool:
        """Claim a slot for an item; return whether no other item claimed it earlier."""
        return self.facts.claim_slot(target.search, target.slot.id(target.map), nodeid)

    def claim_failure(self, key: str, slot: str, nodeid: str) -> str:
        """Claim a failure for an item; return the slot of the item that claimed it earlier, if any.

        ``key`` identifies the failure in all processes.
        """
        first_slot, first_nodeid = self.facts.claim_failure(key, slot, nodeid)
        return "" if first_nodeid == nodeid else first_slot

    def reporting_slot(self, key: str, nodeid: str) -> str:
        """Return the slot of another item that has claimed a failure; empty if there is none."""
        first = self.facts.claimed_failure(key)
        return first[0] if first is not None and first[1] != nodeid else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Films:
    """The films of a run, and what the summary says of them."""

    files: Mapping[FilmKey, Path] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def of_cases(self) -> dict[str, Path]:
        """The films of saved cases by name."""
        return {key[0]: path for key, path in self.files.items() if len(key) == 1}


@dataclass(kw_only=True)
class Run:
    """State of a run in one process; xdist's workers have one each and share the ledger."""

    options: Options
    ledger: Ledger
    pool: Pool
    simulator: Reference
    corpus: Corpus
    """The saved cases."""
    archive: Archive = field(default_factory=Archive)
    """What earlier searches knew when the run began."""
    lock: TextIO | None = None
    """Keeps other runs out of the folder."""
    investigations: Investigations | None = None
    """Those of new signatures, in the process that saves their cases; None if none are saved."""
    searches: Searches = field(init=False)
    items: dict[FlightId, list[SelectedItem]] = field(default_factory=dict)
    """The selected items that judge a flight."""
    search_sizes: list[int] = field(default_factory=list)
    """How many flights the selected items want of each search; saved cases are none."""
    results: dict[FlightId, CompletedFlight] = field(default_factory=dict)
    flight_s: float | None = None
    """Wall time of a flight in the run before in this folder; None if there was none."""
    on_wait: Callable[[], None] = field(default=lambda: None)
    """Called while a flight is waited for."""
    on_wait_end: Callable[[], None] = field(default=lambda: None)
    """Called when the waiting is over."""
    loop_finished: bool = False
    """Whether all tests ran and nobody interrupted them."""
    interrupted: bool = False
    """Whether somebody interrupted the work that follows the tests."""
    investigated: tuple[InvestigatedSignature, ...] = ()
    """Results of the investigation of new signatures."""
    films: Films | None = None
    """The films of what failed, if an option asks for them."""
    remaining: RemainingWork | None = None
    """The work that follows the search, once it is known."""
    save_problem: str = ""
    """Why not everything was saved, empty if it was."""
    user_assertions: dict[tuple[str, str], ItemAssertion] = field(default_factory=dict)
    """Failed assertions about users' own properties, by search and signature."""
    finding_tests: dict[tuple[str, str], str] = field(default_factory=dict)
    """Node ids, without parameters, of tests that failed for a violation, by search and
    signature."""
    reported_failures: dict[str, str] = field(default_factory=dict)
    """Signatures of failed assertions in xdist's workers, by node id."""

    _early_reflights: EarlyReflights = field(init=False)
    _flown_to: dict[str, Slot] = field(init=False, default_factory=dict)
    """The slot of each search up to which all selected slots are flown."""

    def __post_init__(self) -> None:
        self.searches = Searches(
            options=self.options,
            ledger=self.ledger,
            simulator=self.simulator,
            archive=self.archive,
        )
        self._early_reflights = EarlyReflights(self)

    def select(self, items: Sequence[pytest.Item]) -> None:
        """Remember which flights the selected items want.

        Raises LedgerError if a search to resume flew something else.
        """
        searched: dict[str, tuple[Target, set[str]]] = {}
        for item in items:
            target = target_of(item)
            if target is not None:
                self.searches.select(target)
                one = selected(item)
                self.items.setdefault(target.flight, []).append(one)
                if target.entry is None:
                    searched.setdefault(target.search, (target, set()))[1].add(one.test)
        # xdist's controller, which writes the summary and the progress line, has no items.
        facts = self.ledger.facts
        _note_searches(facts, searched.values(), self.options)
        _note_cameras(facts, items)
        self.search_sizes = [len(self.searches.targets[search]) for search in searched]
        if searched:
            facts.note_selected(sum(self.search_sizes))
        if self.options.resume:
            self.searches.check_resumed()

    def note_finding_test(self, search: str, signature: str, nodeid: str) -> None:
        """Note a test that failed for a violation; of several keep the first by name."""
        test = nodeid.partition("[")[0]
        known = self.finding_tests.setdefault((search, signature), test)
        self.finding_tests[search, signature] = min(known, test)

    def close(self) -> None:
        """End the workers, and let others have the ledger."""
        self.end_flights()
        self.ledger.close()
        if self.lock is not None:
            self.lock.close()
        if not self.options.searches_or_repeats and self.options.controller == str(os.getpid()):
            self.ledger.remove()

    def end_flights(self) -> None:
        """End the investigations and the workers."""
        if self.investigations is not None:
            self.investigations.close()
        self.searches.close()
        self.pool.close()

    @functools.cached_property
    def search_names(self) -> dict[str, str]:
        """What texts call each selected search, by its key in the ledger."""
        return self.ledger.facts.search_names

    @functools.cached_property
    def claims(self) -> ReportClaims:
        """Which item of which process reports what."""
        return ReportClaims(facts=self.ledger.facts)

    def fly(self, target: Target, npcs: PolicySpec | None) -> CompletedFlight:
        """Return a slot's flight after it and all lower selected slots are flown."""
        self.searches.register(target.system, npcs)
        try:
            for lower in self.searches.lower(target, self._flown_to.get(target.search)):
                self.flight(lower)
                self._flown_to[target.search] = lower.slot
            return self.flight(target)
        finally:
            self.on_wait_end()

    def flight(self, target: Target) -> CompletedFlight:
        """Return the flight of a slot whose search is registered; wait for it."""
        return self.wait(target.flight)

    def unproven(self, target: Target) -> tuple[str, ...]:
        """Return why a passing case proves nothing; empty if only the landing system changed."""
        if target.case is None:
            return ()
        flight = self.flight(target)
        excuse = flight.result.verdict.excuse
        excused = (f"nobody could have landed ({excuse})",) if excuse else ()
        case = self._proofs.renewed(target.case)
        return *excused, *stale_reasons(case, self._sources(target), flight.sha256)

    def prove_reference(self, target: Target) -> bool:
        """Note it if a case fails to the byte with other sources than its own; return whether."""
        if target.case is None or target.live:
            return False
        sources = self._sources(target)
        proved = proves_reference(target.case, sources, self.flight(target).sha256)
        if proved:
            self._proofs.note(target.case, sources)
        return proved

    def _sources(self, target: Target) -> SourceHashes:
        return SourceHashes(
            system_sha256=combined_sha256(self.searches.sources(target)),
            simulator_sha256=simulator_sha256(self.simulator),
            map_sha256=load_map(target.map, self.options.map_folders).sha256,
        )

    @functools.cached_property
    def _proofs(self) -> Proofs:
        return Proofs(self.options.folder)

    def scenario(self, target: Target) -> Scenario:
        """Return the scenario of a slot."""
        text = self.ledger.scenario(target.flight)
        assert text is not None
        return parse_scenario(text)

    def expected_signatures(self, target: Target) -> dict[str, str]:
        """Return the signatures that known cases of a system on a map expect, with their files.

        A repeated scenario expects none, because the user wants to see it fail.
        """
        options = self.options
        if options.repeat:
            return {}
        system = target.system_name
        expected = self.corpus.expected_signatures(system, target.map, accepted=True)
        return {signature: entry.path.name for signature, entry in expected.items()}

    @functools.cached_property
    def known(self) -> KnownViolations:
        """Which violations of searches the known cases excuse."""
        return KnownViolations(self)

    def refly(self, target: Target, count: int) -> list[CompletedFlight]:
        """Fly a flown slot ``count`` times more."""
        return [self.wait(flight) for flight in self.request_reflights(target, count)]

    def request_reflights(self, target: Target, count: int) -> list[FlightId]:
        """Request that a flown slot is flown ``count`` times more, unless it was already."""
        job = self.ledger.job(target.search)
        assert job is not None
        # The ledger of a search that learns holds other weights than its job.
        result = self.flight(target).result
        text = dump_scenario(self.scenario(target).replace(dict(result.decided)))
        flights = [target.reflight(index) for index in range(count)]
        for flight in flights:
            self.ledger.add_flight(flight, target.system_name, job, text)
        return flights

    def fly_all(
        self, target: Target, npcs: PolicySpec, scenarios: Sequence[Scenario]
    ) -> Sequence[CompletedFlight]:
        """Fly given scenarios beside the searches and return their flights."""
        try:
            job = self.searches.job(target, npcs)
            return list(fly_all(self.ledger, self.pool, job, scenarios, self._advance))
        finally:
            self.on_wait_end()

    def wait(self, flight: FlightId) -> CompletedFlight:
        """Return a flight; it never changes, so the ledger is read once."""
        known = self.results.get(flight)
        if known is None:
            known = wait_for(self.ledger, self.pool, flight, self.options.flights, self._advance)
            self.results[flight] = known
        return known

    def turn(self) -> None:
        """Let the pool fly for a moment, and go on with everything."""
        self.pool.turn()
        self._advance()

    def _advance(self) -> None:
        self.searches.advance()
        self._early_reflights.advance()
        if self.investigations is not None:
            self.investigations.advance()
        self.on_wait()


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


class KnownViolations:
    """Asks the committed and accepted cases; each process of a session comes to the same answer."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._kinds: dict[str, KnownKinds] = {}

    def excuse(self, target: Target, ending: str) -> KnownCaseMatch:
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
            return KnownCaseMatch(known=None, reason=reason)
        return excuse

    def files(self, target: Target, ending: str) -> str:
        """Return the files of the known cases of an ending, for a text."""
        return ", ".join(self._of(target).files(ending))

    def _of(self, target: Target) -> KnownKinds:
        if target.search not in self._kinds:
            run = self._run
            text = run.ledger.job(target.search)
            assert text is not None
            expected = run.corpus.expected_cases(target.system_name, target.map, accepted=True)
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


def _note_cameras(facts: Facts, items: Sequence[pytest.Item]) -> None:
    targets = {each.system_name: each for item in items if (each := target_of(item)) is not None}
    for name, target in targets.items():
        if target.airframe is not None:
            facts.note_camera(name, target.airframe.camera)


def _note_searches(
    facts: Facts, searched: Iterable[tuple[Target, Iterable[str]]], options: Options
) -> None:
    """Note what identifies the selected searches; a resumed run has no search in another domain."""
    known = [key for key in facts.searches.values() if key.domain]
    for target, tests in searched:
        domain = "" if options.repeat else target.domain.label
        key = SearchKey(
            system=target.system_name, map=target.map, domain=domain, tests=tuple(sorted(tests))
        )
        then = {each.domain for each in known if (each.system, each.map) == (key.system, key.map)}
        if options.resume and domain and then and domain not in then:
            raise LedgerError(
                f"--garl-resume: the domain of {key.system} on {key.map} was "
                f"{' and '.join(sorted(then))}, is {domain}; run without --garl-resume to begin "
                "anew"
            )
        facts.note_search(target.search, key)
