"""What flies the slots of a ledger, and how one waits for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.slot import Slot


class Pool(Protocol):
    """Flies the slots of one ledger; pools of several processes may share it.

    Whatever flies claims its slots from the ledger and records them there, so that a pool has
    nothing to return.
    """

    def turn(self) -> None:
        """Let the flying go on for a moment; raise GarlError where it cannot go on."""

    def close(self) -> None:
        """End whatever flies, leave nothing running, and give back what was in flight."""


def wait_for(
    ledger: Ledger, pool: Pool, search: str, slot: Slot, tick: Callable[[], None]
) -> FlightResult:
    """Return a slot's result when it is flown; ``tick`` is called before and while waiting."""
    tick()
    while (result := ledger.result(search, slot.generation, slot.index)) is None:
        pool.turn()
        tick()
    return result
