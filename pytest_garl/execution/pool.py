"""Pools: the protocol of all that fly a ledger's slots, and waiting for a slot's result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.result import FlightResult


class Pool(Protocol):
    """Flies the slots of one ledger; pools of several processes may share it.

    A pool takes slots from the ledger's queue and records the results there, so its methods return
    nothing.
    """

    def turn(self) -> None:
        """Continue the flights for a moment; raise GarlError if they cannot go on."""

    def close(self) -> None:
        """End all flights and processes, and give back the slots in flight."""


def wait_for(
    ledger: Ledger, pool: Pool, flight: FlightId, on_wait: Callable[[], None]
) -> FlightResult:
    """Return a flight's result when it is flown; ``on_wait`` is called before and while waiting."""
    on_wait()
    while (result := ledger.result(flight)) is None:
        pool.turn()
        on_wait()
    return result
