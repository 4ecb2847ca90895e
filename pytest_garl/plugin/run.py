"""One pytest session's part in a run: its items' searches, the ledger, the pool."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import pytest

from pytest_garl.adversary.catalogue import policy_names
from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import SearchKind
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.pool import Pool, wait_for
from pytest_garl.execution.reference import BUILT_IN, Reference, reference_to, simulator_sha256
from pytest_garl.execution.slot import Slot
from pytest_garl.execution.sources import combined_sha256, data_files, sources_of
from pytest_garl.plugin.keys import is_xdist_worker, target_of
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.report_claims import ReportClaims
from pytest_garl.plugin.target import Target

if TYPE_CHECKING:
    from pytest_garl.execution.job import FlightJob
    from pytest_garl.execution.result import CompletedFlight
    from pytest_garl.plugin.user_assertions import ItemAssertion
    from pytest_garl.regressions.follow_up import InvestigatedSignature
    from pytest_garl.regressions.forecast import RemainingWork
    from pytest_garl.scenarios.scenario import Scenario
    from pytest_garl.search.breeder import Breeder
    from pytest_garl.search.method import Method
    from pytest_garl.simulation.npc_policy import PolicySpec

SELECTED = "selected flights"
"""The ledger's fact: how many flights of searches the selected tests want."""
FLIGHT_S = 2.2
"""Wall time of one flight on one core where no earlier run tells: OpenCV-MLS, measured by
``python -m benchmarks``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Selected:
    """A selected test item of a slot.

    ``test`` is the same for all slots of one test; ``shows`` says whether its failure shows: it is
    marked neither to be skipped nor to fail, and takes the slot's landing.
    """

    nodeid: str
    test: str
    shows: bool


def selected(item: pytest.Item) -> Selected:
    """Return what a run must know of an item."""
    marked = any(item.get_closest_marker(name) for name in ("skip", "skipif", "xfail"))
    return Selected(
        nodeid=item.nodeid,
        test=test_of(item),
        shows=not marked and "landing" in getattr(item, "fixturenames", ()),
    )


def test_of(item: pytest.Item) -> str:
    """Return an item's test with its parameters but the slot."""
    callspec, target = getattr(item, "callspec", None), target_of(item)
    # Not pytest's indices of the parameters, which count all items of the test.
    others = callspec.id.replace(target.name, "", 1).strip("-") if callspec and target else ""
    name = f"{item.nodeid.removesuffix(item.name)}{getattr(item, 'originalname', item.name)}"
    return f"{name}[{others}]" if others else name


@dataclass(kw_only=True)
class Run:
    """State of one pytest process; xdist workers each have one and share the ledger."""

    options: Options
    ledger: Ledger
    pool: Pool
    simulator: Reference
    flight_s: float = FLIGHT_S
    on_wait: Callable[[], None] = field(default=lambda: None)
    """Called while a flight is waited for."""
    on_wait_end: Callable[[], None] = field(default=lambda: None)
    """Called when the waiting is over."""
    items: dict[str, dict[Slot, list[Selected]]] = field(default_factory=dict)
    targets: dict[str, dict[Slot, Target]] = field(default_factory=dict)
    breeders: dict[str, Breeder] = field(default_factory=dict)
    results: dict[FlightId, CompletedFlight] = field(default_factory=dict)
    pursued: tuple[InvestigatedSignature, ...] = ()
    """What became of new signatures after the search."""
    rest: RemainingWork | None = None
    """What is to come after the search, when it is known."""
    save_problem: str = ""
    """Why that could not be finished, if it could not."""
    user_assertions: dict[tuple[str, str], ItemAssertion] = field(default_factory=dict)
    """Assertions of tests that failed where the built-in verdict is content, by search and
    signature."""
    finding_tests: dict[tuple[str, str], str] = field(default_factory=dict)
    """The test that failed for a violation, by search and signature: its node id, without
    parameters."""
    reported_failures: dict[str, str] = field(default_factory=dict)
    """Tests of which xdist's workers say that they failed so, with the signature."""
    lock: TextIO | None = None
    loop_finished: bool = False
    """Whether all tests ran to the end of the list, and nobody interrupted them."""

    def select(self, items: list[pytest.Item]) -> None:
        """Remember which slots the selected items want."""
        for item in items:
            target = target_of(item)
            if target is not None:
                wanted = self.items.setdefault(target.search, {})
                wanted.setdefault(target.slot, []).append(selected(item))
                self.targets.setdefault(target.search, {})[target.slot] = target
        searched = sum(
            target.entry is None for slots in self.targets.values() for target in slots.values()
        )
        if searched:
            # For the bar, which xdist's controller draws without having had the items.
            self.ledger.note_fact(SELECTED, searched)

    def check_resumed(self) -> None:
        """Raise LedgerError if a search to resume flew something else."""
        from pytest_garl.execution.job import parse_job

        for search, wanted in self.targets.items():
            target = next(iter(wanted.values()))
            text = self.ledger.job(search)
            if text is not None:
                then = parse_job(text)
                differing = self.job(target, _of_today(then.npcs)).differences(then)
                if differing:
                    raise LedgerError(
                        f"--garl-resume: {target.system.__qualname__} on {target.map} is not what "
                        f"it was: {', '.join(differing)} changed; run without --garl-resume to "
                        "begin anew"
                    )

    def note_finding_test(self, search: str, signature: str, nodeid: str) -> None:
        """Remember which test failed for a violation: of several the first by name."""
        test = nodeid.partition("[")[0]
        known = self.finding_tests.setdefault((search, signature), test)
        self.finding_tests[search, signature] = min(known, test)

    def close(self) -> None:
        """End the flying children and let others have the ledger."""
        self.pool.close()
        self.ledger.close()
        if self.lock is not None:
            self.lock.close()
        if not self.options.searches and self.options.controller == str(os.getpid()):
            self.ledger.remove()

    @functools.cached_property
    def claims(self) -> ReportClaims:
        """Which item of which process reports what."""
        return ReportClaims(ledger=self.ledger)

    def fly(self, target: Target, npcs: PolicySpec) -> CompletedFlight:
        """Return the slot's flight after it and all lower selected slots are flown."""
        self._register(target, npcs)
        try:
            for lower in self.lower_targets(target):
                self._wait(lower.flight)
            return self._wait(target.flight)
        finally:
            self.on_wait_end()

    @property
    def flights(self) -> Path:
        """The folder of the flights' records."""
        return self.options.folder / "flights"

    def unproven(self, target: Target) -> tuple[str, ...]:
        """Return why it proves nothing that a case passes; nothing if the system was repaired."""
        from pytest_garl.regressions.staleness import SourceHashes, stale_reasons
        from pytest_garl.scenarios.maps.map import load_map

        case = target.entry.case if target.entry else None
        if case is None:
            return ()
        sources = SourceHashes(
            system_sha256=combined_sha256(self._sources_of(target)),
            simulator_sha256=simulator_sha256(self.simulator),
            map_sha256=load_map(target.map, self.options.map_folders).sha256,
        )
        return stale_reasons(case, sources, self.flight(target).sha256)

    def scenario(self, target: Target) -> Scenario:
        """Return what a slot flies."""
        from pytest_garl.scenarios.files import parse_scenario

        text = self.ledger.scenario(target.flight)
        assert text is not None
        return parse_scenario(text)

    def expected_signatures(self, target: Target) -> dict[str, str]:
        """Return the signatures that known cases expect of a system on a map, with their files.

        What is repeated is to be seen, known or not.
        """
        options = self.options
        if options.repeat:
            return {}
        system = target.system_name
        expected = options.corpus.expected_signatures(system, target.map, accepted=True)
        return {signature: entry.path.name for signature, entry in expected.items()}

    def may_save(self, session: pytest.Session) -> bool:
        """Whether this process has seen a search to its end and may save what it found."""
        options, worker = self.options, is_xdist_worker(session.config)
        ended = session.exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED)
        stopped = bool(session.shouldfail or session.shouldstop)
        if not (ended and self.loop_finished) or stopped or worker:
            return False
        if options.repeat or not options.shrink:
            return False
        # Interrupted twice, pytest tells of the status that it began with.
        return all(each.flown >= each.all for each in self.ledger.queries.progress())

    def lower_targets(self, target: Target) -> list[Target]:
        """Return what the selected tests of lower slots of a search test."""
        targets = self.targets[target.search]
        return [targets[slot] for slot in sorted(targets) if slot < target.slot]

    def flight(self, target: Target) -> CompletedFlight:
        """Return a slot's flight; wait for its result."""
        return self._wait(target.flight)

    def refly(self, target: Target, count: int) -> list[CompletedFlight]:
        """Fly a flown slot ``count`` times more."""
        job = self.ledger.job(target.search)
        assert job is not None
        text = self.ledger.scenario(target.flight)
        assert text is not None
        flights = [target.reflight(index) for index in range(count)]
        for flight in flights:
            self.ledger.add_flight(flight, target.system_name, job, text)
        return [self._wait(flight) for flight in flights]

    def fly_all(
        self, target: Target, npcs: PolicySpec, scenarios: Sequence[Scenario]
    ) -> Sequence[CompletedFlight]:
        """Return what scenarios come to that are flown beside the searches."""
        from pytest_garl.execution.batch import fly_all

        try:
            job = self.job(target, npcs)
            return list(fly_all(self.ledger, self.pool, job, scenarios, self._advance))
        finally:
            self.on_wait_end()

    def _wait(self, flight: FlightId) -> CompletedFlight:
        """Return a flight; it never changes, so the ledger is read once."""
        known = self.results.get(flight)
        if known is None:
            known = wait_for(self.ledger, self.pool, flight, self.flights, self._advance)
            self.results[flight] = known
        return known

    def _advance(self) -> None:
        """Breed what can be bred, so that the pool has work ahead of the items."""
        for breeder in self.breeders.values():
            breeder.advance()
        self.on_wait()

    def _register(self, target: Target, npcs: PolicySpec) -> None:
        """Put this search, and the others of the same system, into the ledger."""
        for search, wanted in self.targets.items():
            sample = next(iter(wanted.values()))
            if search in self.breeders or sample.system is not target.system:
                continue
            if not sample.broken:
                self._add(search, wanted, npcs)

    def _add(self, search: str, wanted: Mapping[Slot, Target], npcs: PolicySpec) -> None:
        from pytest_garl.adversary.policy_check import check_policy
        from pytest_garl.execution.job import parse_job
        from pytest_garl.scenarios.maps.map import load_map
        from pytest_garl.search.breeder import Breeder

        target = next(iter(wanted.values()))
        npcs = _steered(target, npcs)
        job = self.job(target, npcs)
        case = target.entry.case if target.entry else None
        removed = case.scenario.removed_objects if case else ()
        check_policy(npcs, load_map(job.map, self.options.map_folders).without(removed))
        name = target.system_name
        slots: dict[int, list[int]] = {}
        for slot in sorted(wanted):
            slots.setdefault(slot.generation, []).append(slot.index)
        method = self._method(wanted)
        flights = len(wanted)
        if method.learns:
            flights = max(slots) * self.options.population + len(slots[max(slots)])
        kind: SearchKind = "case" if case else "search"
        self.ledger.add_search(search, name, target.map, flights, job.dumps(), kind)
        nodes = [item.nodeid for each in self.items[search].values() for item in each]
        files = sorted({node.partition("::")[0] for node in nodes})
        # For the summary, which xdist's controller writes without having had the items.
        self.ledger.note_fact(f"files of {name} on {target.map}", " ".join(files))
        known = self.ledger.job(search)
        if known is not None and job.differences(parse_job(known)):
            raise LedgerError(
                f"{name} on {target.map}: two sets of tests fly the same search with different "
                f"{', '.join(job.differences(parse_job(known)))}"
            )
        self.breeders[search] = Breeder(self.ledger, search, method, slots)

    def job(self, target: Target, npcs: PolicySpec) -> FlightJob:
        """Return what a child must know to fly a target."""
        from pytest_garl.execution.job import FlightJob
        from pytest_garl.scenarios.maps.map import load_map

        map = load_map(target.map, self.options.map_folders)
        sources = self._sources_of(target)
        own = sources_of(self.simulator.load()) if self.simulator != BUILT_IN else ()
        return FlightJob.for_system(
            reference_to(target.system),
            map,
            npcs,
            system_sha256=combined_sha256(sources),
            sources=tuple(sorted({*sources, *own})),
            simulator=self.simulator,
            map_folders=self.options.map_folders,
            limits=target.limits,
            timeout_s=self.options.timeout_s,
            flights=self.flights,
        )

    def _sources_of(self, target: Target) -> tuple[tuple[str, str], ...]:
        return sources_of(target.system, data_files(target.files, self.options.root))

    def _method(self, wanted: Mapping[Slot, Target]) -> Method:
        from pytest_garl.scenarios.genes import genome_for
        from pytest_garl.scenarios.maps.map import load_map
        from pytest_garl.search.catalogue import make_method
        from pytest_garl.search.fixed import FixedScenarios
        from pytest_garl.search.method import SearchPlan

        if any(each.entry for each in wanted.values()) or self.options.repeat:
            return FixedScenarios(
                {slot: _repeated(self.options, each) for slot, each in wanted.items()}
            )
        map = load_map(next(iter(wanted.values())).map, self.options.map_folders)
        plan = SearchPlan(
            map=map,
            genome=genome_for(map, weather=self.options.weather),
            seed=self.options.seed,
            population=self.options.population,
        )
        return make_method(self.options.method, plan)


def _steered(target: Target, npcs: PolicySpec) -> PolicySpec:
    """Return who moves the objects: a case's are those of its record, or of its policy."""
    from pytest_garl.adversary.catalogue import policy_spec
    from pytest_garl.adversary.recorded import recorded_spec

    case = target.entry.case if target.entry else None
    if case is None:
        return npcs
    if not target.live:
        return recorded_spec(dict(case.moves), dict(case.changes))
    return policy_spec(case.policy) if case.policy in policy_names() else npcs


def _of_today(npcs: PolicySpec) -> PolicySpec:
    """Return a policy with the weights that its file holds today."""
    from pytest_garl.adversary.catalogue import policy_spec

    weights = str(dict(npcs.arguments).get("weights", ""))
    return replace(npcs, arguments=policy_spec(weights).arguments) if weights else npcs


def _repeated(options: Options, target: Target) -> Scenario:
    """Return the scenario that a case holds, or that ``--garl-repeat`` names."""
    from pytest_garl.scenarios.files import load

    if target.entry is not None and target.entry.case is not None:
        return target.entry.case.scenario
    if target.file:
        return load(Path(target.file), options.map_folders)
    assert options.repeated_slot is not None
    return options.repeated_slot.scenarios[target.system_name]
