"""A ledger of three slots that wait for a flight, and short ways to read one flight."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.result import FlightResult

FACTS = {"seed": 3, "version": "1"}


def waiting_ledger(path: Path) -> Ledger:
    ledger = Ledger.create(path, FACTS)
    ledger.add_search("s", "systems:Good", "court", 3, "{}")
    ledger.add_slots("s", 0, {0: "a", 1: "b", 2: "c"})
    return ledger


def result_of(ledger: Ledger, flight: FlightId) -> FlightResult | None:
    completed = ledger.completed(flight, Path())
    return completed.result if completed else None


def sha256_of(ledger: Ledger, flight: FlightId) -> str:
    completed = ledger.completed(flight, Path())
    return completed.sha256 if completed else ""
