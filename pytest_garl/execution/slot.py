"""Slots of a search: each is flown once, and has its name before its scenario is known."""

from __future__ import annotations

from dataclasses import dataclass


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
