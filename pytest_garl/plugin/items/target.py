"""The target of one item: a landing system on a map, with a slot, a saved case or a file."""

from __future__ import annotations

import dataclasses
import functools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pytest_garl.execution.flight_id import FIRST_SLOT, LIVE, OF_CASE, FlightId, Slot, search_key
from pytest_garl.execution.reference import reference_to
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.task import DEFAULT_TASK, Task

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pytest_garl.cases.case import Case
    from pytest_garl.cases.corpus import CorpusEntry
    from pytest_garl.execution.stored_ledger import StoredFlight, StoredSlot
    from pytest_garl.landing_system import Airframe, NavigationKind
    from pytest_garl.program import AnySystem
    from pytest_garl.scenarios.domains.domain import Domain
    from pytest_garl.verdicts.verdict import Limits


@dataclass(frozen=True, kw_only=True)
class Target:
    """A landing system on a map, and the flight that an item judges."""

    system: AnySystem
    limits: Limits
    map: str = ""
    """Empty for a saved case whose file cannot be read."""
    task: Task = DEFAULT_TASK
    """The marker on the ground and the start of a search; cases and files have their own."""
    domain: Domain
    """What a search varies, and what a case is compared with."""
    slot: Slot = FIRST_SLOT
    deterministic: bool = True
    """Whether the marker says that the system repeats its flights exactly."""
    files: tuple[str, ...] = ()
    """Data files of the system, below the project's root."""
    file: str = ""
    """A scenario file to repeat; empty for a slot of a search."""
    stored: StoredSlot | None = None
    """The slot of an earlier search, if it is flown again."""
    entry: CorpusEntry | None = None
    """A saved case."""
    live: bool = False
    """Whether the search's policy moves the case's NPCs, instead of their recorded moves."""

    @property
    def name(self) -> str:
        """The slot's id in the item's name."""
        if self.entry is not None:
            return f"{OF_CASE}{self.entry.name}{LIVE if self.live else ''}"
        return f"file-{Path(self.file).stem}" if self.file else self.slot.id(self.map)

    @property
    def system_name(self) -> str:
        """The landing system's name in ledgers and cases: "module:class"."""
        return f"{self.system.__module__}:{self.system.__qualname__}"

    @property
    def airframe(self) -> Airframe | None:
        """What the landing system declares of its UAV; None if that cannot be read."""
        from pytest_garl.landing_system import airframe_of

        try:
            return airframe_of(self.system)
        except Exception:  # noqa: BLE001 (code of a landing system; the flights report what it raises)
            return None

    @property
    def navigation(self) -> NavigationKind:
        """What the airframe's navigation rests on; of one that cannot be read, the default."""
        from pytest_garl.landing_system import Airframe

        return (self.airframe or Airframe()).navigation

    @property
    def case(self) -> Case | None:
        """The saved case, if the target is one and its file can be read."""
        return self.entry.case if self.entry is not None else None

    @property
    def broken(self) -> str:
        """The problem of the case's file, empty if it can be read."""
        return self.entry.problem if self.entry is not None else ""

    @property
    def is_searched(self) -> bool:
        """Whether a search breeds the scenario; else a saved case or a file holds it."""
        return self.entry is None and not self.file

    @property
    def stored_flight(self) -> StoredFlight | None:
        """The flight to repeat: that of the same search if the earlier run had it."""
        return self.stored.flight(self.search, self.system_name) if self.stored else None

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
        if self.task != DEFAULT_TASK:
            facts.append(dataclasses.asdict(self.task))
        if self.is_searched:
            facts.append(self.domain.label)
        if self.entry is not None:
            facts += [str(self.entry.path), self.live]
        return search_key(json.dumps(facts))

    @property
    def flight_key(self) -> str:
        """Names the flight that the item judges in reports: its search and its slot."""
        return f"{self.search} {self.name}"

    @property
    def flight(self) -> FlightId:
        """The flight that the item judges."""
        return FlightId(search=self.search, map=self.map, slot=self.slot)

    def outside_domain(self, map_folders: Sequence[Path]) -> str:
        """Return the file of a case and its values outside the test's domain; empty if it has none.

        The case is flown all the same: what was found once must not come back unnoticed.
        """
        if self.case is None or self.entry is None:
            return ""
        map = load_map(self.map, map_folders)
        values = "; ".join(self.domain.outside(self.case.scenario, map))
        file = self.entry.path.name
        return f"{file} is outside the domain {self.domain.name}: {values}" if values else ""

    def reflight(self, index: int) -> FlightId:
        """Return the flight that repeats the item's flight for the ``index``-th time."""
        key = search_key(f"again {self.search} {self.slot.id(self.map)} {index}")
        return FlightId(search=key, map=self.map)
