from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import VERSION
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.ledger import Ledger
from tests.execution.ledgers import FACTS, result_of, waiting_ledger
from tests.support.results import flight_result


def test_ledger_refuses_other_scenarios_for_the_same_slots(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    ledger.add_slots("s", 0, {0: "a", 1: "b"})
    with pytest.raises(LedgerError, match="generation 0 was bred in another way"):
        ledger.add_slots("s", 0, {1: "other"})


def test_resumed_ledger_gives_back_slots_in_flight(tmp_path: Path) -> None:
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
    assert (again.flight.slot.index, again.earlier_exits) == (1, "")


def test_new_run_keeps_the_previous_ledger(tmp_path: Path) -> None:
    first = waiting_ledger(tmp_path / "ledger.sqlite")
    first.close()
    Ledger.create(tmp_path / "ledger.sqlite", FACTS).close()
    kept = Ledger(tmp_path / "ledger-previous.sqlite")
    assert kept.queries.unflown("s", 0) == 3


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({"seed": 4, "version": "1"}, "seed was 3, is 4"),
        ({"seed": 3, "version": "2"}, "version was 1, is 2"),
    ],
)
def test_resume_refuses_another_run(tmp_path: Path, facts: dict[str, Any], words: str) -> None:
    waiting_ledger(tmp_path / "ledger.sqlite").close()
    with pytest.raises(LedgerError, match=words):
        Ledger.resume(tmp_path / "ledger.sqlite", facts)


def test_resume_refuses_a_ledger_of_another_version(tmp_path: Path) -> None:
    waiting_ledger(tmp_path / "ledger.sqlite").close()
    database = sqlite3.connect(tmp_path / "ledger.sqlite")
    database.execute("UPDATE run SET value = '1' WHERE key = 'ledger'")
    database.commit()
    database.close()
    with pytest.raises(LedgerError, match=f"ledger was 1, is {VERSION}"):
        Ledger.resume(tmp_path / "ledger.sqlite", FACTS)


@pytest.mark.parametrize("damage", ["text", "middle", "empty"])
def test_resume_of_a_damaged_ledger_raises_one_clear_error(tmp_path: Path, damage: str) -> None:
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


def test_resume_refuses_a_missing_ledger(tmp_path: Path) -> None:
    with pytest.raises(LedgerError, match="there is no ledger"):
        Ledger.resume(tmp_path / "ledger.sqlite", FACTS)


def test_resumed_ledger_forgets_the_facts_of_the_session(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    ledger.facts.note_ran("test_one")
    ledger.facts.note_selected(7)
    ledger.close()
    ledger = Ledger.resume(tmp_path / "ledger.sqlite", FACTS)
    assert not ledger.facts.has_run("test_one")
    assert ledger.facts.selected == 7


def test_an_emptied_ledger_ends_the_wait_for_a_flight(tmp_path: Path) -> None:
    """As a landing system does that truncates the file: its readers would wait for ever."""
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    flight = FlightId(search="search", map="lawn", slot=Slot(generation=0, index=0))
    assert ledger.completed(flight, tmp_path) is None
    (tmp_path / "ledger.sqlite").write_bytes(b"")
    with pytest.raises(LedgerError, match="emptied"):
        ledger.completed(flight, tmp_path)
