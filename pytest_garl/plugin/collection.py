"""What items test: slots of a search, saved cases, repeated scenarios."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import check_system, reference_to
from pytest_garl.execution.slot import Slot, slots
from pytest_garl.execution.sources import data_files
from pytest_garl.plugin.options import SLOT_ID, Options

if TYPE_CHECKING:
    from pytest_garl.regressions.corpus import CorpusEntry
    from pytest_garl.scenarios.scenario import Scenario
    from pytest_garl.verdicts.verdict import Limits


FIRST = Slot(generation=0, index=0)
"""The one slot of what is no search."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """What an item tests: which system on which map, and what it flies."""

    system: type
    map: str
    limits: Limits
    slot: Slot
    deterministic: bool = True
    """Whether the system does the same in the same flight, as its marker says."""
    files: tuple[str, ...] = ()
    """Data files of the system, below the project's root."""
    file: str = ""
    """A scenario file to repeat; empty for a slot of a search."""
    entry: CorpusEntry | None = None
    """A saved case."""
    live: bool = False
    """Whether the case's objects are steered as in a search, and do not repeat their moves."""

    @property
    def name(self) -> str:
        """The slot's id in the item's name."""
        if self.entry is not None:
            return f"case-{self.entry.name}{'-live' if self.live else ''}"
        return f"file-{Path(self.file).stem}" if self.file else self.slot.id(self.map)

    @property
    def broken(self) -> str:
        """What is wrong with the case's file, if anything is."""
        return self.entry.problem if self.entry is not None else ""

    @functools.cached_property
    def search(self) -> str:
        """Key of the search that the slot belongs to; each flight of a case has its own."""
        reference = reference_to(self.system)
        facts: list[Any] = [
            reference.module,
            reference.qualname,
            self.map,
            dataclasses.asdict(self.limits),
        ]
        if self.entry is not None:
            facts += [str(self.entry.path), self.live]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:16]


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """What a marker says."""

    system: type
    maps: tuple[str, ...]
    limits: Limits
    deterministic: bool
    files: tuple[str, ...]

    def target(self, map: str, slot: Slot) -> Target:
        """Return what an item tests that flies a slot on a map."""
        return Target(
            system=self.system,
            map=map,
            limits=self.limits,
            slot=slot,
            deterministic=self.deterministic,
            files=self.files,
        )


def targets_for(marker: pytest.Mark, options: Options, test: str) -> list[Target]:
    """Return the saved cases and the slots of a marked test, which is called ``test``.

    Raises GarlError for a marker that makes no sense.
    """
    subject = read_marker(marker, options)
    if options.repeat:
        return [each for map in subject.maps for each in _repeated_targets(subject, map, options)]
    searched = [
        subject.target(map, slot)
        for map in subject.maps
        for slot in slots(options.budget, options.population)
    ]
    return [*_saved_targets(subject, options, test), *searched]


def _saved_targets(subject: Subject, options: Options, test: str) -> Iterator[Target]:
    if not options.cases.is_dir() and not options.cases.is_symlink():
        return
    from pytest_garl.regressions.corpus import entries
    from pytest_garl.scenarios.maps.map import map_names

    there = map_names(options.map_folders)
    for entry in entries(options.cases, name_of(subject.system), options.map_folders):
        head = entry.head
        if head is None or head.map not in there:
            yield dataclasses.replace(subject.target("", FIRST), entry=entry)
            continue
        if head.map not in subject.maps or head.own_test not in ("", test):
            continue
        target = dataclasses.replace(subject.target(head.map, FIRST), entry=entry)
        yield target
        if head.status == "fixed" and head.avoidable == "live":
            yield dataclasses.replace(target, live=True)


def repeated(options: Options, target: Target) -> Scenario:
    """Return the scenario that a case holds, or that ``--garl-repeat`` names."""
    from pytest_garl.execution.job import load_scenario
    from pytest_garl.scenarios.files import load

    if target.entry is not None and target.entry.case is not None:
        return target.entry.case.scenario
    if target.file:
        return load(Path(target.file), options.map_folders)
    return load_scenario(_recorded(options, target)[name_of(target.system)])


def _repeated_targets(subject: Subject, map: str, options: Options) -> list[Target]:
    if Path(options.repeat).is_file():
        from pytest_garl.files.toml import parse
        from pytest_garl.scenarios.files import map_name_in

        text = Path(options.repeat).read_text(encoding="utf-8")
        if "violation" in parse(text, options.repeat):
            raise GarlError(
                f"--garl-repeat={options.repeat}: found a saved case, expected a slot or a file "
                f"with a scenario; cases are flown by: garl cases replay {options.repeat}"
            )
        if map_name_in(text, source=options.repeat) != map:
            return []
        return [dataclasses.replace(subject.target(map, FIRST), file=options.repeat)]
    match = SLOT_ID.fullmatch(options.repeat)
    if match is None or match["map"] != map:
        return []
    slot = Slot(generation=int(match["generation"]), index=int(match["slot"]))
    target = subject.target(map, slot)
    return [target] if name_of(subject.system) in _recorded(options, target) else []


def _recorded(options: Options, target: Target) -> dict[str, str]:
    path = options.folder / "ledger.sqlite"
    if not path.is_file():
        raise GarlError(
            f"--garl-repeat={options.repeat}: there is no ledger at {path}; run a search first, "
            "or give a scenario file"
        )
    from pytest_garl.execution.stored_ledger import check_stored

    ledger = Ledger(path)
    try:
        check_stored(ledger)
        return ledger.queries.scenarios(target.slot.generation, target.slot.index, target.map)
    finally:
        ledger.close()


def name_of(system: type) -> str:
    """Return a system's name in ledgers and cases: "module:class"."""
    return f"{system.__module__}:{system.__qualname__}"


def read_marker(marker: pytest.Mark, options: Options) -> Subject:
    """Return what a marker says; raise GarlError for one that makes no sense."""
    from pytest_garl.scenarios.maps.map import load_map, map_names
    from pytest_garl.verdicts.verdict import Limits

    known = {"system", "maps", "limits", "deterministic", "files"}
    unknown = sorted(set(marker.kwargs) - known)
    if unknown or marker.args:
        raise GarlError(
            f"mark.garl: found {', '.join(unknown) or 'positional arguments'}, expected keywords "
            "system=, maps=, limits=, deterministic= and files="
        )
    if "system" not in marker.kwargs:
        raise GarlError("mark.garl: system= is missing; give the landing system's class")
    system = marker.kwargs["system"]
    check_system(system)
    maps = marker.kwargs.get("maps", ("court", "lawn"))
    maps = (maps,) if isinstance(maps, str) else tuple(maps)
    if not maps:
        there = ", ".join(map_names(options.map_folders))
        raise GarlError(f"mark.garl: maps=[]: nothing to fly on; expected one or more of {there}")
    for map in maps:
        load_map(map, options.map_folders)
    limits = marker.kwargs.get("limits", Limits())
    if isinstance(limits, dict):
        limits = _limits(limits)
    if not isinstance(limits, Limits):
        raise GarlError(f"mark.garl: limits={limits!r}: expected pytest_garl.limits(...)")
    deterministic = marker.kwargs.get("deterministic", True)
    if not isinstance(deterministic, bool):
        raise GarlError(f"mark.garl: deterministic={deterministic!r}: expected True or False")
    return Subject(
        system=system,
        maps=tuple(m for m in maps if not options.maps or m in options.maps),
        limits=limits,
        deterministic=deterministic,
        files=_files(marker.kwargs.get("files", ()), options),
    )


def _limits(given: dict[Any, Any]) -> Limits:
    from pytest_garl.verdicts.verdict import Limits

    known = [field.name for field in dataclasses.fields(Limits)]
    unknown = [str(key) for key in given if key not in known]
    if unknown:
        raise GarlError(
            f"mark.garl: limits={given!r}: found {', '.join(unknown)}, expected "
            f"{', '.join(known[:-1])} or {known[-1]}, such as limits(distance_m=1.0)"
        )
    return Limits(**given)


def _files(given: Any, options: Options) -> tuple[str, ...]:
    """Return the marker's data files; raise GarlError for what is none."""
    named = isinstance(given, list | tuple) and all(isinstance(each, str | Path) for each in given)
    if not named:
        raise GarlError(f"mark.garl: files={given!r}: expected a list of paths, as ['model.onnx']")
    files = tuple(str(each) for each in given)
    try:
        data_files(files, options.root)
    except FileNotFoundError as error:
        raise GarlError(
            f"mark.garl: files: there is no {str(error)!r} below {options.root}; expected a file "
            "or a folder"
        ) from error
    return files
