"""Pools: the protocol of all that fly a ledger's slots, and waiting for a slot's result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from pytest_garl.execution.flight_id import CompletedFlight, FlightId
from pytest_garl.execution.ledger import Ledger


class Pool(Protocol):
    """Flies the slots of one ledger; pools of several processes may share it.

    A pool takes slots from the ledger's queue and records the results there, so its methods return
    nothing.
    """

    @property
    def in_process(self) -> bool:
        """Whether it flies in this process, where nothing else may compute during a flight."""

    def turn(self) -> None:
        """Continue the flights for a moment; raise GarlError if they cannot go on."""

    def close(self) -> None:
        """End all flights and processes, and give back the slots in flight."""


def wait_for(
    ledger: Ledger, pool: Pool, flight: FlightId, folder: Path, on_wait: Callable[[], None]
) -> CompletedFlight:
    """Wait until a flight is flown and return it; its record is in a folder.

    ``on_wait`` is called once before the wait, and after each turn of the pool.
    """
    on_wait()
    while (completed := ledger.completed(flight, folder)) is None:
        pool.turn()
        on_wait()
    return completed
