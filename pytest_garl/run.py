"""One pytest session's part in a run: its items' searches, the ledger, the pool."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.options import SLOT_ID, Options, target_of
from pytest_garl.search.ledger import Ledger
from pytest_garl.search.pool import Pool
from pytest_garl.search.reference import Reference, check_system, reference_to
from pytest_garl.search.slots import Slot, population, slots

if TYPE_CHECKING:
    from pytest_garl.scenarios.scenario import Scenario
    from pytest_garl.simulation.policy import PolicySpec
    from pytest_garl.verdicts.verdict import Limits

FLIGHT_S = 3.0
"""Wall time of one flight on one core where no earlier run tells: OpenCV-MLS, measured by
``python -m benchmarks``."""


@dataclass(frozen=True, slots=True, kw_only=True)
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

    @property
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
    registered: set[str] = field(default_factory=set)

    def select(self, items: list[pytest.Item]) -> None:
        """Remember which slots the selected items want."""
        for item in items:
            target = target_of(item)
            if target is not None:
                wanted = self.items.setdefault(target.search, {})
                wanted.setdefault(target.slot, []).append(item.nodeid)
                self.targets.setdefault(target.search, {})[target.slot] = target

    def first_item(self, target: Target) -> str:
        """Return the node id of the first selected item of a slot."""
        return self.items[target.search][target.slot][0]

    def fly(self, target: Target, npcs: PolicySpec) -> dict[str, Any]:
        """Return the slot's result after it and all lower selected slots are flown."""
        self._register(target, npcs)
        try:
            for slot in sorted(self.items[target.search]):
                if slot <= target.slot:
                    self.pool.wait(target.search, slot, self.tick)
        finally:
            self.waited()
        result = self.ledger.result(target.search, target.slot.generation, target.slot.index)
        assert result is not None
        return result

    def twin(self, target: Target, signature: str) -> str:
        """Return the lowest selected slot below with the same signature, or nothing."""
        for slot in sorted(self.items[target.search]):
            if slot >= target.slot:
                break
            result = self.ledger.result(target.search, slot.generation, slot.index)
            if result and result["verdict"]["signature"] == signature:
                return slot.id(target.map)
        return ""

    def _register(self, target: Target, npcs: PolicySpec) -> None:
        """Put this search, and the others of the same system, into the ledger."""
        for search, wanted in self.targets.items():
            sample = next(iter(wanted.values()))
            if search not in self.registered and sample.system is target.system:
                self.registered.add(search)
                self._add(search, wanted, npcs)

    def _add(self, search: str, wanted: Mapping[Slot, Target], npcs: PolicySpec) -> None:
        from pytest_garl.scenarios.maps import load_map
        from pytest_garl.search.job import Job, dump_scenario

        target = next(iter(wanted.values()))
        map = load_map(target.map, self.options.map_folders)
        job = Job(
            system=reference_to(target.system),
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
        scenarios = self._scenarios(wanted)
        rows = [
            (slot.generation, slot.index, dump_scenario(scenario))
            for slot, scenario in scenarios.items()
        ]
        name = f"{job.system.module}:{job.system.qualname}"
        self.ledger.add_search(search, name, map.name, self.options.budget, job.dumps(), rows)

    def _scenarios(self, wanted: Mapping[Slot, Target]) -> dict[Slot, Scenario]:
        from pytest_garl.scenarios.genes import genome_for
        from pytest_garl.scenarios.maps import load_map
        from pytest_garl.search.random_search import propose

        target = next(iter(wanted.values()))
        if self.options.repeat:
            return {slot: repeated(self.options, each) for slot, each in wanted.items()}
        map = load_map(target.map, self.options.map_folders)
        genome = genome_for(map, weather=self.options.weather)
        size = population(self.options.budget)
        bred = {
            generation: propose(map, genome, self.options.seed, generation, size)
            for generation in sorted({slot.generation for slot in wanted})
        }
        return {slot: bred[slot.generation][slot.index] for slot in sorted(wanted)}


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
                for slot in slots(options.budget)
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
