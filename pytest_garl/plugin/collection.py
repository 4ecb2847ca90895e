"""The items of a marked test: slots of a search, saved cases, a repeated scenario."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.slot import Slot, slots
from pytest_garl.plugin.marker import MarkerArguments, read_marker
from pytest_garl.plugin.options import SLOT_ID, Options
from pytest_garl.plugin.target import FIRST, Target, name_of

if TYPE_CHECKING:
    from pytest_garl.scenarios.scenario import Scenario


def targets_for(marker: pytest.Mark, options: Options, test: str) -> list[Target]:
    """Return the saved cases and the slots of a marked test, which is called ``test``.

    Raises GarlError for a marker that makes no sense.
    """
    marked = read_marker(marker, options)
    if options.repeat:
        return [each for map in marked.maps for each in _repeated_targets(marked, map, options)]
    searched = [
        marked.target(map, slot)
        for map in marked.maps
        for slot in slots(options.budget, options.population)
    ]
    return [*_saved_targets(marked, options, test), *searched]


def _saved_targets(marked: MarkerArguments, options: Options, test: str) -> Iterator[Target]:
    if not options.cases.is_dir() and not options.cases.is_symlink():
        return
    from pytest_garl.scenarios.maps.map import map_names

    there = map_names(options.map_folders)
    for entry in options.corpus.entries(name_of(marked.system)):
        header = entry.header
        if header is None or header.map not in there:
            yield dataclasses.replace(marked.target("", FIRST), entry=entry)
            continue
        if header.map not in marked.maps or header.own_test not in ("", test):
            continue
        target = dataclasses.replace(marked.target(header.map, FIRST), entry=entry)
        yield target
        if header.status == "fixed" and header.avoidable == "live":
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


def _repeated_targets(marked: MarkerArguments, map: str, options: Options) -> list[Target]:
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
        return [dataclasses.replace(marked.target(map, FIRST), file=options.repeat)]
    match = SLOT_ID.fullmatch(options.repeat)
    if match is None or match["map"] != map:
        return []
    slot = Slot(generation=int(match["generation"]), index=int(match["slot"]))
    target = marked.target(map, slot)
    return [target] if name_of(marked.system) in _recorded(options, target) else []


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
