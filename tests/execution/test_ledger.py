from __future__ import annotations

import os
import sqlite3
import subprocess
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.ledger import VERSION, Ledger

FACTS = {"seed": 3, "version": "1"}


def made(path: Path) -> Ledger:
    ledger = Ledger.create(path, FACTS)
    ledger.add_search("s", "systems:Good", "court", 3, "{}")
    ledger.add_slots("s", 0, {0: "a", 1: "b", 2: "c"})
    return ledger


def test_a_slot_is_handed_out_once_and_recorded_once(tmp_path: Path) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    claims = [ledger.claim() for _ in range(4)]
    assert [claim.slot if claim else None for claim in claims] == [0, 1, 2, None]
    assert claims[0] is not None
    ledger.record(claims[0], {"n": 1}, "hash", 0.1)
    ledger.record(claims[0], {"n": 2}, "other", 0.1)
    assert ledger.result("s", 0, 0) == {"n": 1}
    assert ledger.meters()["flights"] == 1


def test_slots_are_bred_the_same_way_or_not_at_all(tmp_path: Path) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    ledger.add_slots("s", 0, {0: "a", 1: "b"})
    with pytest.raises(LedgerError, match="generation 0 was bred in another way"):
        ledger.add_slots("s", 0, {1: "other"})


def test_a_claim_of_a_silent_process_lapses(tmp_path: Path) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    first = ledger.claim(lease_s=-1.0)
    assert first is not None
    ledger.release_dead()
    again = ledger.claim()
    assert again is not None
    assert again.slot == first.slot
    ledger.release_dead()
    other = ledger.claim(lease_s=None)
    assert other is not None
    assert other.slot == 1


def test_a_claim_of_a_child_that_lives_never_lapses(tmp_path: Path) -> None:
    """Its pool watches it: it may be silent for as long as it flies."""
    ledger = made(tmp_path / "ledger.sqlite")
    assert ledger.take_seat(1, os.getpid)
    assert ledger.claim(lease_s=-1.0)
    ledger.release_dead()
    assert ledger.claim_of(os.getpid())


@pytest.mark.parametrize(("lease_s", "kept"), [(3600.0, True), (-1.0, False)])
def test_a_dead_child_is_left_to_its_pool_for_as_long_as_the_lease(
    tmp_path: Path, lease_s: float, kept: bool
) -> None:
    path = tmp_path / "ledger.sqlite"
    ledger = made(path)
    with subprocess.Popen(["true"]) as child:
        child.wait()
    assert ledger.take_seat(1, lambda: child.pid)
    assert Ledger(path, child.pid).claim(lease_s=lease_s)
    ledger.release_dead()
    assert (ledger.claim_of(child.pid) is not None) == kept


def test_a_dead_child_whose_pool_is_gone_is_given_back_at_once(tmp_path: Path) -> None:
    path = tmp_path / "ledger.sqlite"
    ledger = made(path)
    with subprocess.Popen(["true"]) as child:
        child.wait()
    assert Ledger(path, child.pid).claim()
    ledger.release_dead()
    assert ledger.claim_of(child.pid) is None


def test_where_a_process_was_when_it_was_ended_is_no_part_of_the_hash(tmp_path: Path) -> None:
    def flown(path: Path, text: str) -> str:
        ledger = made(path)
        claim = ledger.claim()
        assert claim is not None
        ledger.record(claim, {"crash": {"error": "Timeout", "traceback": text}}, "", 0.0)
        return ledger.result_hash()

    assert flown(tmp_path / "one.sqlite", "line 3") == flown(tmp_path / "two.sqlite", "line 4")


def test_resuming_gives_back_what_was_in_flight(tmp_path: Path) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    claim = ledger.claim()
    assert claim is not None
    ledger.record(claim, {"n": 1}, "", 0.0)
    ledger.claim()
    ledger.close()
    ledger = Ledger.resume(tmp_path / "ledger.sqlite", FACTS)
    assert ledger.result("s", 0, 0) == {"n": 1}
    again = ledger.claim()
    assert again is not None
    assert (again.slot, again.after) == (1, "")


def test_a_new_run_keeps_the_ledger_before_it(tmp_path: Path) -> None:
    first = made(tmp_path / "ledger.sqlite")
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
    made(tmp_path / "ledger.sqlite").close()
    with pytest.raises(LedgerError, match=words):
        Ledger.resume(tmp_path / "ledger.sqlite", facts)


def test_a_ledger_of_another_version_is_not_resumed(tmp_path: Path) -> None:
    made(tmp_path / "ledger.sqlite").close()
    database = sqlite3.connect(tmp_path / "ledger.sqlite")
    database.execute("UPDATE run SET value = '1' WHERE key = 'ledger'")
    database.commit()
    database.close()
    with pytest.raises(LedgerError, match=f"ledger was 1, is {VERSION}"):
        Ledger.resume(tmp_path / "ledger.sqlite", FACTS)


@pytest.mark.parametrize("damage", ["text", "middle", "empty"])
def test_a_damaged_ledger_is_one_clear_error(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "ledger.sqlite"
    made(path).close()
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


def test_the_hash_covers_results_not_costs(tmp_path: Path) -> None:
    hashes = set()
    for wall_s in (0.1, 0.2):
        ledger = made(tmp_path / "ledger.sqlite")
        claim = ledger.claim()
        assert claim is not None
        where = f"Thread 0x{os.getpid() + int(10 * wall_s):x}"
        ledger.record(claim, {"traceback": where}, "hash", wall_s)
        hashes.add(ledger.result_hash())
        ledger.close()
    assert len(hashes) == 1


def test_a_search_has_a_hash_and_a_time_of_its_own(tmp_path: Path) -> None:
    def flown(path: Path, value: int) -> Ledger:
        ledger = made(path)
        ledger.add_search("t", "systems:Good", "lawn", 1, "{}")
        ledger.add_slots("t", 0, {0: "d"})
        while claim := ledger.claim():
            result = {"n": value if claim.search == "t" else 1}
            ledger.record(claim, result, "hash", 0.5)
        return ledger

    one, other = flown(tmp_path / "one.sqlite", 1), flown(tmp_path / "other.sqlite", 2)
    assert one.result_hash("s") == other.result_hash("s")
    assert one.result_hash("t") != other.result_hash("t")
    assert len({one.result_hash(), one.result_hash("s"), one.result_hash("t")}) == 3
    assert (one.flying_s("s"), one.flying_s("t"), one.flying_s("u")) == (1.5, 0.5, 0.0)


def test_nobody_flies_beside_a_slot_that_flies_again(tmp_path: Path) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    first = ledger.claim()
    assert first is not None
    ledger.fly_alone(first, "died")
    again = ledger.claim()
    assert again is not None
    assert (again.slot, again.after, again.attempt) == (first.slot, "died", 2)
    assert ledger.waiting() == 2
    assert ledger.claim() is None
    ledger.record(again, {"n": 1}, "", 0.0)
    beside = ledger.claim()
    assert beside is not None
    assert beside.slot == 1


def test_a_slot_flies_again_when_the_others_have_come_down(tmp_path: Path) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    first, other = ledger.claim(), ledger.claim()
    assert first is not None
    assert other is not None
    ledger.fly_alone(first, "hung")
    assert ledger.claim() is None
    ledger.record(other, {"n": 1}, "", 0.0)
    again = ledger.claim()
    assert again is not None
    assert again.slot == first.slot


def test_a_run_that_is_resumed_twice_counts_no_attempt_of_what_was_in_flight(
    tmp_path: Path,
) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    for _ in range(2):
        claim = ledger.claim()
        assert claim is not None
        assert (claim.slot, claim.attempt) == (0, 1)
        ledger.close()
        ledger = Ledger.resume(tmp_path / "ledger.sqlite", FACTS)
    again = ledger.claim()
    assert again is not None
    assert again.attempt == 1
    beside = ledger.claim()
    assert beside is not None
    assert beside.slot == 1


def test_process_that_has_flown_gets_slots_of_its_own_system_alone(tmp_path: Path) -> None:
    ledger = made(tmp_path / "ledger.sqlite")
    ledger.add_search("t", "systems:Other", "court", 2, "{}")
    ledger.add_slots("t", 0, {0: "d", 1: "e"})
    first = ledger.claim(flown="systems:Other")
    again = ledger.claim(flown="systems:Other")
    assert first is not None
    assert again is not None
    assert [(first.search, first.slot), (again.search, again.slot)] == [("t", 0), ("t", 1)]
    assert ledger.claim(flown="systems:Other") is None
    assert ledger.others_wait("systems:Other")
    assert not ledger.others_wait("systems:Good")
    assert ledger.claim(flown="systems:Good") is not None
