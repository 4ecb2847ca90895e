"""Flights of a ledger: slot, key, the file of the record, and the flight once it is completed."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.execution.result import FlightResult

KEY_DIGITS = 16
"""Hexadecimal digits of a search's key: 64 bits, so that two searches never have the same."""
NAME_DIGITS = 8
"""Digits of the key that a record's name repeats, to be short."""

OF_CASE, LIVE = "case-", "-live"
"""What an item's id puts before the name of a saved case, and behind it if the policy of the search
moves the case's NPCs."""


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Slot:
    """One flight in a search: ``court-g03-s17`` is slot 17 of generation 3 on the court."""

    generation: int
    index: int

    def id(self, map: str) -> str:
        """Return the slot's name in item ids."""
        return f"{map}-g{self.generation:02d}-s{self.index:02d}"


def slots(budget: int, size: int) -> tuple[Slot, ...]:
    """Return exactly ``budget`` slots in generations of ``size``; the last may be shorter."""
    return tuple(Slot(generation=n // size, index=n % size) for n in range(budget))


FIRST_SLOT = Slot(generation=0, index=0)
"""The only slot of a search that flies once."""


def search_key(facts: str) -> str:
    """Return the key in the ledger of the search that ``facts`` describe."""
    return hashlib.sha256(facts.encode()).hexdigest()[:KEY_DIGITS]


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightId:
    """One flight of a ledger: the key of its search, its slot there, its map."""

    search: str
    map: str
    slot: Slot = FIRST_SLOT

    @property
    def key(self) -> tuple[str, int, int]:
        """The primary key in the ledger's table: search, generation, slot."""
        return self.search, self.slot.generation, self.slot.index

    @property
    def slot_id(self) -> str:
        """The slot's name in item ids, such as ``court-g03-s17``."""
        return self.slot.id(self.map)

    @property
    def name(self) -> str:
        """The name of the flight's record, such as ``0123abcd-court-g03-s17``."""
        return f"{self.search[:NAME_DIGITS]}-{self.slot_id}"

    def record(self, folder: Path) -> Path:
        """Return the file of the flight's record in a folder of flights."""
        return folder / f"{self.name}.npz"


@dataclass(frozen=True, slots=True, kw_only=True)
class CompletedFlight:
    """A flight of a ledger that has a result; ``record`` is the file of its record.

    ``sha256`` is the hash of its trajectory, empty if its process did not survive.
    """

    result: FlightResult
    sha256: str
    record: Path

    @property
    def signature(self) -> str:
        """How it ended, as in the result; empty for a flight without violation."""
        return self.result.signature
