"""What ``--garl-repeat`` names, read once: a slot of an earlier search, or a scenario file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from pytest_garl.errors import GarlError, ScenarioError
from pytest_garl.execution.flight_id import Slot
from pytest_garl.execution.stored_ledger import StoredSlot, read_slot
from pytest_garl.files.user_files import parse, read_text
from pytest_garl.messages import command
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import SLOT_ID, Options
from pytest_garl.scenarios.files import map_name_in


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeated:
    """A scenario that is flown again."""

    map: str
    file: str = ""
    stored: StoredSlot | None = None
    """A slot, as the earlier search flew it; None for a file."""

    def targets(self, on_maps: Mapping[str, Target]) -> list[Target]:
        """Return what a test flies, given its target on each map: this scenario, or nothing."""
        if self.map not in on_maps:
            return []
        target = on_maps[self.map]
        if self.stored is None:
            return [replace(target, file=self.file)]
        target = replace(target, slot=self.stored.slot, stored=self.stored)
        return [target] if target.stored_flight else []


def read_repeated(options: Options) -> Repeated:
    """Return what ``--garl-repeat`` names.

    Raises UsageError if the file holds no scenario, or the ledger of the earlier search not this
    slot, or if one of them cannot be read.
    """
    try:
        match = SLOT_ID.fullmatch(options.repeat)
        if match is None:
            return _in_file(options.repeat)
        slot = Slot(generation=int(match["generation"]), index=int(match["slot"]))
        stored = read_slot(options.search_ledger, match["map"], slot)
        return Repeated(map=stored.map, stored=stored)
    except GarlError as error:
        raise pytest.UsageError(f"--garl-repeat={options.repeat}: {error}") from error


def _in_file(file: str) -> Repeated:
    text = read_text(Path(file))
    if "violation" in parse(text, file):
        raise ScenarioError(
            "found a saved case, expected a slot or a file with a scenario; cases are flown by: "
            + command("garl", "cases", "replay", file)
        )
    return Repeated(map=map_name_in(text, source=file), file=file)
