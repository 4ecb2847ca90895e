"""The state of a run in one pytest process: options, ledger, pool, flights and findings."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TextIO

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.batch import fly_all
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, Slot
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.pool import Pool, wait_for
from pytest_garl.execution.reference import Reference, simulator_sha256
from pytest_garl.execution.sources import combined_sha256
from pytest_garl.plugin.early_reflights import EarlyReflights
from pytest_garl.plugin.keys import target_of
from pytest_garl.plugin.known_violations import KnownViolations
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.search_setup import Searches
from pytest_garl.plugin.target import Target
from pytest_garl.regressions.reference_proofs import Proofs, proves_reference
from pytest_garl.regressions.replay import SourceHashes, stale_reasons
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import PolicySpec

if TYPE_CHECKING:
    from pytest_garl.plugin.films import Films
    from pytest_garl.plugin.kind_news import KindNews
    from pytest_garl.plugin.user_assertions import ItemAssertion
    from pytest_garl.regressions.follow_up import InvestigatedSignature
    from pytest_garl.regressions.forecast import RemainingWork
    from pytest_garl.regressions.investigations import Investigations

from pytest_garl.execution.ledger import SESSION_FACT
from pytest_garl.reports.search_summary import CAMERA, DOMAINS

SELECTED = "selected flights"
"""The ledger's fact: how many flights of searches the selected tests want."""


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

    ledger: Ledger

    def claim_slot(self, target: Target, nodeid: str) -> bool:
        """Claim a slot for an item; return whether no other item claimed it earlier."""
        key = f"{SESSION_FACT}slot {target.search} {target.slot.id(target.map)}"
        return bool(self.ledger.first_fact(key, nodeid) == nodeid)

    def claim_failure(self, key: str, slot: str, nodeid: str) -> str:
        """Claim a failure for an item; return the slot of the item that claimed it earlier, if any.

        ``key`` identifies the failure in all processes.
        """
        first_slot, first_nodeid = self.ledger.first_fact(_failure_fact(key), [slot, nodeid])
        return "" if first_nodeid == nodeid else str(first_slot)

    def reporting_slot(self, key: str, nodeid: str) -> str:
        """Return the slot of another item that has claimed a failure; empty if there is none."""
        first = self.ledger.fact(_failure_fact(key))
        return str(first[0]) if first is not None and first[1] != nodeid else ""

    def note_ran(self, nodeid: str) -> None:
        """Note that a test has run; its claims are in the ledger by then."""
        self.ledger.note_fact(f"{SESSION_FACT}ran {nodeid}", value=True)

    def has_run(self, nodeid: str) -> bool:
        """Return whether a test has run in any process."""
        return bool(self.ledger.fact(f"{SESSION_FACT}ran {nodeid}"))


def _failure_fact(key: str) -> str:
    return f"{SESSION_FACT}failure {key}"


@dataclass(kw_only=True)
class Run:
    """State of a run in one process; xdist's workers have one each and share the ledger."""

    options: Options
    ledger: Ledger
    pool: Pool
    simulator: Reference
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
    news: KindNews | None = None
    """Writes a sentence about each new kind while the run goes on."""
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
        self.searches = Searches(options=self.options, ledger=self.ledger, simulator=self.simulator)
        self._early_reflights = EarlyReflights(self)

    def select(self, items: Sequence[pytest.Item]) -> None:
        """Remember which flights the selected items want.

        Raises LedgerError if a search to resume flew something else.
        """
        files: dict[str, set[str]] = {}
        domains: dict[str, set[str]] = {}
        for item in items:
            target = target_of(item)
            if target is not None:
                self.searches.select(target)
                self.items.setdefault(target.flight, []).append(selected(item))
                search = f"{target.system_name} on {target.map}"
                files.setdefault(search, set()).add(item.nodeid.partition("::")[0])
                if target.is_searched and target.domain and not self.options.repeat:
                    domains.setdefault(search, set()).add(target.domain.label)
        # xdist's controller, which writes the summary and the progress line, has no items.
        for search, names in files.items():
            self.ledger.note_fact(f"files of {search}", " ".join(sorted(names)))
        for search, labels in domains.items():
            _note_domains(self.ledger, search, labels, resumed=self.options.resume)
        _note_cameras(self.ledger, items)
        wanted = self.searches.targets.values()
        searched = [slots for slots in wanted if not any(each.entry for each in slots.values())]
        self.search_sizes = [len(slots) for slots in searched]
        if searched:
            self.ledger.note_fact(SELECTED, sum(self.search_sizes))
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
        self.pool.close()

    @functools.cached_property
    def claims(self) -> ReportClaims:
        """Which item of which process reports what."""
        return ReportClaims(ledger=self.ledger)

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
        expected = options.corpus.expected_signatures(system, target.map, accepted=True)
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
        text = self.ledger.scenario(target.flight)
        assert text is not None
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


def _note_cameras(ledger: Ledger, items: Sequence[pytest.Item]) -> None:
    """Note the camera of each landing system, so that a report can draw its frames again."""
    targets = {each.system_name: each for item in items if (each := target_of(item)) is not None}
    for name, target in targets.items():
        airframe = target.airframe
        if airframe is not None:
            ledger.note_fact(f"{CAMERA}{name}", dataclasses.asdict(airframe.camera))


def _note_domains(ledger: Ledger, search: str, wanted: set[str], *, resumed: bool) -> None:
    """Note in which domains a system is flown on a map; a resumed run has the same ones."""
    key = f"{DOMAINS}{search}"
    known = ledger.fact(key)
    if resumed and known is not None and not wanted <= {*known}:
        raise LedgerError(
            f"--garl-resume: the domain of {search} was {' and '.join(known)}, is "
            f"{' and '.join(sorted(wanted))}; run without --garl-resume to begin anew"
        )
    ledger.note_fact(key, sorted({*(known or ()), *wanted}))
