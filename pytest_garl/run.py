"""One pytest session's part in a run: its items' searches, the ledger, the pool."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import pytest

from pytest_garl.errors import GarlError, LedgerError
from pytest_garl.options import SLOT_ID, Options
from pytest_garl.search.ledger import Ledger
from pytest_garl.search.pool import Pool
from pytest_garl.search.reference import Reference, check_system, reference_to, sources_sha256
from pytest_garl.search.slots import Slot, slots
from pytest_garl.switches import target_of

if TYPE_CHECKING:
    from pytest_garl.scenarios.scenario import Scenario
    from pytest_garl.search.breeder import Breeder
    from pytest_garl.search.job import Job
    from pytest_garl.search.method import Flown, Method
    from pytest_garl.simulation.policy import PolicySpec
    from pytest_garl.verdicts.verdict import Limits

FLIGHT_S = 2.2
"""Wall time of one flight on one core where no earlier run tells: OpenCV-MLS, measured by
``python -m benchmarks``."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """What an item tests: which system on which map, and what it flies."""

    system: type
    map: str
    limits: Limits
    slot: Slot
    file: str = ""
    """A scenario file to repeat; empty for a slot of a search."""

    @property
    def name(self) -> str:
        """The slot's id in the item's name."""
        return f"file-{Path(self.file).stem}" if self.file else self.slot.id(self.map)

    @functools.cached_property
    def search(self) -> str:
        """Key of the search that the slot belongs to."""
        reference = reference_to(self.system)
        facts = [reference.module, reference.qualname, self.map, dataclasses.asdict(self.limits)]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:16]


@dataclass(kw_only=True)
class Run:
    """State of one pytest process; xdist workers each have one and share the ledger."""

    options: Options
    ledger: Ledger
    pool: Pool
    simulator: Reference
    flight_s: float = FLIGHT_S
    tick: Callable[[], None] = field(default=lambda: None)
    """Called while a flight is waited for."""
    waited: Callable[[], None] = field(default=lambda: None)
    """Called when the waiting is over."""
    items: dict[str, dict[Slot, list[str]]] = field(default_factory=dict)
    targets: dict[str, dict[Slot, Target]] = field(default_factory=dict)
    breeders: dict[str, Breeder] = field(default_factory=dict)
    results: dict[tuple[str, Slot], dict[str, Any]] = field(default_factory=dict)
    lock: TextIO | None = None

    def select(self, items: list[pytest.Item]) -> None:
        """Remember which slots the selected items want."""
        for item in items:
            target = target_of(item)
            if target is not None:
                wanted = self.items.setdefault(target.search, {})
                wanted.setdefault(target.slot, []).append(item.nodeid)
                self.targets.setdefault(target.search, {})[target.slot] = target

    def check_resumed(self) -> None:
        """Raise LedgerError if a search to resume flew something else."""
        from pytest_garl.search.job import loads

        for search, wanted in self.targets.items():
            target = next(iter(wanted.values()))
            text = self.ledger.job(search)
            if text is not None:
                then = loads(text)
                differing = self._job(target, then.npcs).differences(then)
                if differing:
                    raise LedgerError(
                        f"--garl-resume: {target.system.__qualname__} on {target.map} is not what "
                        f"it was: {', '.join(differing)} changed; run without --garl-resume to "
                        "begin anew"
                    )

    def close(self) -> None:
        """End the flying children and let others have the ledger."""
        self.pool.close()
        self.ledger.close()
        if self.lock is not None:
            self.lock.close()

    def first_item(self, target: Target) -> str:
        """Return the node id of the first selected item of a slot."""
        return self.items[target.search][target.slot][0]

    def fly(self, target: Target, npcs: PolicySpec) -> dict[str, Any]:
        """Return the slot's result after it and all lower selected slots are flown."""
        self._register(target, npcs)
        search = target.search
        try:
            for slot in self._lower(search, target.slot):
                self._wait(search, slot)
            return self._wait(search, target.slot)
        finally:
            self.waited()

    def twin(self, target: Target, signature: str) -> str:
        """Return the lowest selected slot below with the same signature, or nothing."""
        search = target.search
        for slot in self._lower(search, target.slot):
            if self._wait(search, slot)["verdict"]["signature"] == signature:
                return slot.id(target.map)
        return ""

    def _lower(self, search: str, below: Slot) -> list[Slot]:
        return [slot for slot in sorted(self.items[search]) if slot < below]

    def _wait(self, search: str, slot: Slot) -> dict[str, Any]:
        """Return a slot's result; what is flown never changes and is asked for once."""
        known = self.results.get((search, slot))
        if known is None:
            known = self.results[search, slot] = self.pool.wait(search, slot, self._advance)
        return known

    def _advance(self) -> None:
        """Breed what can be bred, so that the pool has work ahead of the items."""
        for breeder in self.breeders.values():
            breeder.advance()
        self.tick()

    def _register(self, target: Target, npcs: PolicySpec) -> None:
        """Put this search, and the others of the same system, into the ledger."""
        for search, wanted in self.targets.items():
            sample = next(iter(wanted.values()))
            if search not in self.breeders and sample.system is target.system:
                self._add(search, wanted, npcs)

    def _add(self, search: str, wanted: Mapping[Slot, Target], npcs: PolicySpec) -> None:
        from pytest_garl.adversary.policies import check_policy
        from pytest_garl.scenarios.maps import load_map
        from pytest_garl.search.breeder import Breeder
        from pytest_garl.search.job import loads

        target = next(iter(wanted.values()))
        job = self._job(target, npcs)
        check_policy(npcs, load_map(job.map, self.options.map_folders))
        name = f"{job.system.module}:{job.system.qualname}"
        slots: dict[int, list[int]] = {}
        for slot in sorted(wanted):
            slots.setdefault(slot.generation, []).append(slot.index)
        method = self._method(wanted)
        flights = len(wanted)
        if method.learns:
            flights = max(slots) * self.options.population + len(slots[max(slots)])
        self.ledger.add_search(search, name, target.map, flights, job.dumps())
        nodes = [node for each in self.items[search].values() for node in each]
        files = sorted({node.partition("::")[0] for node in nodes})
        # For the summary, which xdist's controller writes without having had the items.
        self.ledger.note_fact(f"files of {name} on {target.map}", " ".join(files))
        known = self.ledger.job(search)
        if known is not None and job.differences(loads(known)):
            raise LedgerError(
                f"{name} on {target.map}: two sets of tests fly the same search with different "
                f"{', '.join(job.differences(loads(known)))}"
            )
        self.breeders[search] = Breeder(self.ledger, search, method, slots)

    def _job(self, target: Target, npcs: PolicySpec) -> Job:
        from pytest_garl.scenarios.maps import load_map
        from pytest_garl.search.job import Job

        map = load_map(target.map, self.options.map_folders)
        return Job(
            system=reference_to(target.system),
            system_sha256=sources_sha256(target.system),
            simulator=self.simulator,
            map=map.name,
            map_sha256=map.sha256,
            map_folders=tuple(str(folder) for folder in self.options.map_folders),
            npcs=npcs,
            limits=target.limits,
            timeout_s=self.options.timeout_s,
            path=tuple(_path()),
            flights=str(self.options.folder / "flights"),
        )

    def _method(self, wanted: Mapping[Slot, Target]) -> Method:
        from pytest_garl.scenarios.genes import genome_for
        from pytest_garl.scenarios.maps import load_map
        from pytest_garl.search.method import Plan
        from pytest_garl.search.methods import make_method

        if self.options.repeat:
            return _Repeat({slot: repeated(self.options, each) for slot, each in wanted.items()})
        map = load_map(next(iter(wanted.values())).map, self.options.map_folders)
        plan = Plan(
            map=map,
            genome=genome_for(map, weather=self.options.weather),
            seed=self.options.seed,
            population=self.options.population,
        )
        return make_method(self.options.method, plan)


class _Repeat:
    """Proposes the one scenario that is repeated, in whatever slot it has."""

    learns = False

    def __init__(self, scenarios: Mapping[Slot, Scenario]) -> None:
        self._scenarios, self._generation = scenarios, -1

    def ask(self) -> Sequence[Scenario]:
        self._generation += 1
        first = next(iter(self._scenarios.values()))
        size = 1 + max(slot.index for slot in self._scenarios)
        slots = [Slot(generation=self._generation, index=index) for index in range(size)]
        return [self._scenarios.get(slot, first) for slot in slots]

    def tell(self, flown: Sequence[Flown]) -> Sequence[tuple[float, ...]]:
        return ()


def targets_for(marker: pytest.Mark, options: Options) -> list[Target]:
    """Return the slots of a marked test; raise GarlError for a marker that makes no sense."""
    system, maps, limits = _read_marker(marker, options)
    found = []
    for map in maps:
        if options.repeat:
            found += _repeated_targets(system, map, limits, options)
        else:
            found += [
                Target(system=system, map=map, limits=limits, slot=slot)
                for slot in slots(options.budget, options.population)
            ]
    return found


def repeated(options: Options, target: Target) -> Scenario:
    """Return the scenario that ``--garl-repeat`` names for a system and map."""
    from pytest_garl.scenarios.files import load
    from pytest_garl.search.job import load_scenario

    if target.file:
        return load(Path(target.file), options.map_folders)
    return load_scenario(_recorded(options, target)[_name(target.system)])


def _repeated_targets(system: type, map: str, limits: Limits, options: Options) -> list[Target]:
    if Path(options.repeat).is_file():
        from pytest_garl.scenarios.files import map_name_in

        text = Path(options.repeat).read_text(encoding="utf-8")
        if map_name_in(text, source=options.repeat) != map:
            return []
        slot = Slot(generation=0, index=0)
        return [Target(system=system, map=map, limits=limits, slot=slot, file=options.repeat)]
    match = SLOT_ID.fullmatch(options.repeat)
    if match is None or match["map"] != map:
        return []
    slot = Slot(generation=int(match["generation"]), index=int(match["slot"]))
    target = Target(system=system, map=map, limits=limits, slot=slot)
    return [target] if _name(system) in _recorded(options, target) else []


def _recorded(options: Options, target: Target) -> dict[str, str]:
    path = options.folder / "ledger.sqlite"
    if not path.is_file():
        raise GarlError(
            f"--garl-repeat={options.repeat}: there is no ledger at {path}; run a search first, "
            "or give a scenario file"
        )
    ledger = Ledger(path)
    try:
        return ledger.scenarios(target.slot.generation, target.slot.index, target.map)
    finally:
        ledger.close()


def _name(system: type) -> str:
    return f"{system.__module__}:{system.__qualname__}"


def _read_marker(marker: pytest.Mark, options: Options) -> tuple[type, tuple[str, ...], Limits]:
    from pytest_garl.scenarios.maps import load_map
    from pytest_garl.verdicts.verdict import Limits

    known = {"system", "maps", "limits"}
    unknown = sorted(set(marker.kwargs) - known)
    if unknown or marker.args:
        raise GarlError(
            f"mark.garl: found {', '.join(unknown) or 'positional arguments'}, expected keywords "
            "system=, maps= and limits="
        )
    if "system" not in marker.kwargs:
        raise GarlError("mark.garl: system= is missing; give the landing system's class")
    system = marker.kwargs["system"]
    check_system(system)
    maps = marker.kwargs.get("maps", ("court", "lawn"))
    maps = (maps,) if isinstance(maps, str) else tuple(maps)
    for map in maps:
        load_map(map, options.map_folders)
    limits = marker.kwargs.get("limits", Limits())
    if isinstance(limits, dict):
        try:
            limits = Limits(**limits)
        except TypeError as error:
            raise GarlError(f"mark.garl: limits={limits!r}: {error}") from error
    if not isinstance(limits, Limits):
        raise GarlError(f"mark.garl: limits={limits!r}: expected pytest_garl.limits(...)")
    return system, tuple(m for m in maps if not options.maps or m in options.maps), limits


def _path() -> list[str]:
    return [entry for entry in sys.path if entry]
