from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import VERSION
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.ledger import Ledger
from tests.execution.ledgers import FACTS, result_of, waiting_ledger
from tests.support.results import flight_result


def test_slots_are_bred_the_same_way_or_not_at_all(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    ledger.add_slots("s", 0, {0: "a", 1: "b"})
    with pytest.raises(LedgerError, match="generation 0 was bred in another way"):
        ledger.add_slots("s", 0, {1: "other"})


def test_resuming_gives_back_what_was_in_flight(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    claim = ledger.queue.claim()
    assert claim is not None
    ledger.queue.record(claim, flight_result(), "", 0.0)
    ledger.queue.claim()
    ledger.close()
    ledger = Ledger.resume(tmp_path / "ledger.sqlite", FACTS)
    assert result_of(ledger, FlightId(search="s", map="court")) == flight_result()
    again = ledger.queue.claim()
    assert again is not None
    assert (again.flight.slot.index, again.after) == (1, "")


def test_a_new_run_keeps_the_ledger_before_it(tmp_path: Path) -> None:
    first = waiting_ledger(tmp_path / "ledger.sqlite")
    first.close()
    Ledger.create(tmp_path / "ledger.sqlite", FACTS).close()
    kept = Ledger(tmp_path / "ledger-previous.sqlite")
    assert kept.unflown("s", 0) == 3


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({"seed": 4, "version": "1"}, "seed was 3, is 4"),
        ({"seed": 3, "version": "2"}, "version was 1, is 2"),
    ],
)
def test_another_run_is_not_resumed(tmp_path: Path, facts: dict[str, Any], words: str) -> None:
    waiting_ledger(tmp_path / "ledger.sqlite").close()
    with pytest.raises(LedgerError, match=words):
        Ledger.resume(tmp_path / "ledger.sqlite", facts)


def test_a_ledger_of_another_version_is_not_resumed(tmp_path: Path) -> None:
    waiting_ledger(tmp_path / "ledger.sqlite").close()
    database = sqlite3.connect(tmp_path / "ledger.sqlite")
    database.execute("UPDATE run SET value = '1' WHERE key = 'ledger'")
    database.commit()
    database.close()
    with pytest.raises(LedgerError, match=f"ledger was 1, is {VERSION}"):
        Ledger.resume(tmp_path / "ledger.sqlite", FACTS)


@pytest.mark.parametrize("damage", ["text", "middle", "empty"])
def test_a_damaged_ledger_is_one_clear_error(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "ledger.sqlite"
    waiting_ledger(path).close()
    whole = path.read_bytes()
    broken = {
        "text": b"not a database, surely" * 50,
        "middle": whole[:4096] + os.urandom(len(whole) - 8192) + whole[-4096:],
        "empty": b"",
    }
    path.write_bytes(broken[damage])
    with pytest.raises(LedgerError, match=r"ledger\.sqlite"):
        Ledger.resume(path, FACTS)


def test_a_missing_ledger_is_not_resumed(tmp_path: Path) -> None:
    with pytest.raises(LedgerError, match="there is no ledger"):
        Ledger.resume(tmp_path / "ledger.sqlite", FACTS)
