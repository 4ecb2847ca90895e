"""A ledger of three slots that wait for a flight."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.execution.ledger import Ledger

FACTS = {"seed": 3, "version": "1"}


def waiting_ledger(path: Path) -> Ledger:
    ledger = Ledger.create(path, FACTS)
    ledger.add_search("s", "systems:Good", "court", 3, "{}")
    ledger.add_slots("s", 0, {0: "a", 1: "b", 2: "c"})
    return ledger
