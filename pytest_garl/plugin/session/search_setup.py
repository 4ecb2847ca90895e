"""The searches that the selected items fly: their jobs, methods and breeders.

A saved case, and a repeated scenario, is a search whose scenarios are given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from pytest_garl.cpu_dispatch import libraries_off_baseline
from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import SearchKind
from pytest_garl.execution.flight_id import Slot
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import BUILT_IN, Reference, reference_to
from pytest_garl.execution.sources import combined_sha256, data_files, source_hashes
from pytest_garl.npcs.policy_catalogue import names_policy, policy_names, policy_spec
from pytest_garl.npcs.policy_check import check_policy
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import Options
from pytest_garl.program import AnySystem
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.own_navigation import within
from pytest_garl.scenarios.files import load
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.use_file import UseFile, read_use
from pytest_garl.search.archive import Archive, Knowledge, flown_by
from pytest_garl.search.breeder import Breeder
from pytest_garl.search.fixed import FixedScenarios
from pytest_garl.search.method import Method, SearchPlan
from pytest_garl.search.method_catalogue import make_method, method_names, remembers
from pytest_garl.search.separate_method import MethodProcess, SeparateMethod
from pytest_garl.search.teaching import Lessons, Teacher
from pytest_garl.simulation.npc_policy import PolicySpec


@dataclass(kw_only=True)
class Searches:
    """The searches of a run, by their keys in the ledger."""

    options: Options
    ledger: Ledger
    simulator: Reference
    archive: Archive = field(default_factory=Archive)
    """What earlier searches knew."""
    targets: dict[str, dict[Slot, Target]] = field(default_factory=dict)
    """Targets of the selected items, by search and slot."""
    breeders: dict[str, Breeder] = field(default_factory=dict)
    """Breeders of the searches that the ledger has."""
    teacher: Teacher = field(default_factory=Teacher)
    """Trains the directors of the searches."""
    method_process: MethodProcess = field(default_factory=MethodProcess)
    """Breeds for them if this process computes otherwise than others do."""

    @cached_property
    def model_of_use(self) -> UseFile | None:
        """The model of use, if the method draws from one."""
        return read_use(self.options.use) if self.options.use else None

    def close(self) -> None:
        """End the processes of the searches."""
        self.teacher.close()
        self.method_process.close()

    def select(self, target: Target) -> None:
        """Add the target of a selected item."""
        self.targets.setdefault(target.search, {})[target.slot] = target

    def lower(self, target: Target, above: Slot | None = None) -> list[Target]:
        """Return the targets of the selected items of lower slots of the same search.

        With ``above``, of those that are higher than this slot.
        """
        wanted = self.targets[target.search]
        slots = (slot for slot in wanted if slot < target.slot and (not above or slot > above))
        return [wanted[slot] for slot in sorted(slots)]

    def register(self, system: AnySystem, npcs: PolicySpec | None) -> None:
        """Put all searches of a landing system into the ledger.

        Without a policy the NPCs of each search move as its domain says.  Raises LedgerError if two
        sets of tests fly the same search differently, PolicyError for a policy that is none.
        """
        for search, wanted in self.targets.items():
            sample = next(iter(wanted.values()))
            if search not in self.breeders and sample.system is system and not sample.broken:
                self._register(search, wanted, npcs)

    def advance(self) -> None:
        """Breed all generations whose parents have flown, so that the pool has work."""
        for breeder in self.breeders.values():
            breeder.advance()

    def check_resumed(self) -> None:
        """Raise LedgerError if the job of a search changed since the run that is resumed."""
        for search, wanted in self.targets.items():
            target = next(iter(wanted.values()))
            text = self.ledger.job(search)
            if text is not None:
                then = parse_job(text)
                differing = self.job(target, _with_weights_of_today(then.npcs)).differences(then)
                if differing:
                    raise LedgerError(
                        f"--garl-resume: {target.system.__qualname__} on {target.map} is not what "
                        f"it was: {', '.join(differing)} changed; run without --garl-resume to "
                        "begin anew"
                    )

    def job(self, target: Target, npcs: PolicySpec) -> FlightJob:
        """Return what a worker must know to fly a target."""
        sources = self.sources(target)
        simulator = source_hashes(self.simulator.load()) if self.simulator != BUILT_IN else ()
        return FlightJob.for_system(
            reference_to(target.system),
            load_map(target.map, self.options.map_folders),
            npcs,
            system_sha256=combined_sha256(sources),
            sources=tuple(sorted({*sources, *simulator})),
            simulator=self.simulator,
            map_folders=self.options.map_folders,
            limits=target.limits,
            timeout_s=self.options.timeout_s,
            flights=self.options.flights,
        )

    def policy_name(self, target: Target) -> str:
        """Return the policy of a target's NPCs, unless a fixture names one."""
        options, earlier = self.options, target.stored_flight
        stored = earlier.npcs if earlier else ""
        if not options.npcs and names_policy(stored):
            return stored
        return options.policy_in(target.domain)

    def sources(self, target: Target) -> tuple[tuple[str, str], ...]:
        """Return name and hash of everything that a target's landing system consists of."""
        return source_hashes(target.system, data_files(target.files, self.options.root))

    def _register(
        self, search: str, wanted: Mapping[Slot, Target], given: PolicySpec | None
    ) -> None:
        target = next(iter(wanted.values()))
        npcs = npc_policy_of(target, given or policy_spec(self.policy_name(target)))
        job = self.job(target, npcs)
        removed = target.case.scenario.removed_objects if target.case else ()
        check_policy(npcs, load_map(job.map, self.options.map_folders).without(removed))
        method = self._method(search, target, wanted, job)
        slots = _by_generation(wanted)
        flights = len(wanted)
        if method.learns:
            # Every generation before the last is flown whole.
            flights = max(slots) * self.options.population + len(slots[max(slots)])
        name = target.system_name
        kind: SearchKind = "case" if target.case else "search"
        self.ledger.add_search(search, name, target.map, flights, job.dumps(), kind)
        known = self.ledger.job(search)
        if known is not None and job.differences(parse_job(known)):
            raise LedgerError(
                f"{name} on {target.map}: two sets of tests fly the same search with different "
                f"{', '.join(job.differences(parse_job(known)))}"
            )
        self.breeders[search] = Breeder(
            self.ledger, search, method, slots, self._lessons(search, target, job, method)
        )

    def _lessons(
        self, search: str, target: Target, job: FlightJob, method: Method
    ) -> Lessons | None:
        """Return what trains the director of a search, None if nobody decides or learns."""
        airframe = target.airframe
        if not method.learns or airframe is None or job.simulator != BUILT_IN:
            return None
        if not job.npcs.decides_begin or dict(job.npcs.arguments):
            return None
        return Lessons(self.teacher, search, job, airframe)

    def _method(
        self, search: str, target: Target, wanted: Mapping[Slot, Target], job: FlightJob
    ) -> Method:
        if target.entry or self.options.repeat:
            return FixedScenarios(
                {slot: _scenario_of(self.options, each) for slot, each in wanted.items()}
            )
        map = load_map(target.map, self.options.map_folders)
        domain = within(target.domain, target.navigation)
        genome, own = genome_of(domain, map, target.task), Knowledge()
        if self.archive.searches and remembers(self.options.method):
            own = self.archive.knowledge(search, flown_by(job.dumps()), genome, map)
            self.ledger.facts.note_knowledge(search, len(own.known), len(own.suspects))
        plan = SearchPlan(
            map=map,
            genome=genome,
            seed=self.options.seed,
            flights=self.options.budget,
            population=self.options.population,
            known=own.known,
            suspects=own.suspects,
            use=self.model_of_use,
        )
        name = self.options.method
        if name in method_names() and libraries_off_baseline():
            return SeparateMethod(self.method_process, search, name, plan)
        return make_method(name, plan)


def _by_generation(slots: Iterable[Slot]) -> dict[int, list[int]]:
    """Return the indices of slots, in order, by their generation."""
    found: dict[int, list[int]] = {}
    for slot in sorted(slots):
        found.setdefault(slot.generation, []).append(slot.index)
    return found


def npc_policy_of(target: Target, npcs: PolicySpec) -> PolicySpec:
    """Return the NPC policy: of a case the recorded moves, or for a live one its policy."""
    case = target.case
    if case is None:
        return npcs
    if not target.live:
        return case.behaviour.policy
    return policy_spec(case.policy) if case.policy in policy_names() else npcs


def _with_weights_of_today(npcs: PolicySpec) -> PolicySpec:
    """Return a policy with the weights that its file holds today."""
    weights = str(dict(npcs.arguments).get("weights", ""))
    return replace(npcs, arguments=policy_spec(weights).arguments) if weights else npcs


def _scenario_of(options: Options, target: Target) -> Scenario:
    """Return the scenario of a saved case, or of ``--garl-repeat``."""
    if target.case is not None:
        return target.case.scenario
    if target.file:
        return load(Path(target.file), options.map_folders)
    assert target.stored_flight is not None
    return target.stored_flight.scenario
