from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from pytest_garl.execution.database import BEHIND_SEARCHES
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import WorkQueue
from tests.execution.ledgers import FACTS, result_of, waiting_ledger
from tests.support.results import flight_result


def test_slot_is_claimed_once_and_recorded_once(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    claims = [ledger.queue.claim() for _ in range(4)]
    assert [claim.flight.slot.index if claim else None for claim in claims] == [0, 1, 2, None]
    assert claims[0] is not None
    ledger.queue.record(claims[0], flight_result(), "hash", 0.1)
    ledger.queue.record(claims[0], flight_result(elapsed_s=2.0), "other", 0.1)
    assert result_of(ledger, FlightId(search="s", map="court")) == flight_result()
    assert ledger.queries.meters()["flights"] == 1


def test_claim_of_an_unwatched_process_lapses_after_its_lease(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    first = ledger.queue.claim(lease_s=-1.0)
    assert first is not None
    ledger.queue.release_dead()
    again = ledger.queue.claim()
    assert again is not None
    assert again.flight == first.flight
    ledger.queue.release_dead()
    other = ledger.queue.claim(lease_s=None)
    assert other is not None
    assert other.flight.slot.index == 1


def test_claim_of_a_living_worker_never_lapses(tmp_path: Path) -> None:
    """Its pool watches it: it may be silent for as long as it flies."""
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    assert ledger.queue.register_worker(1, os.getpid)
    assert ledger.queue.claim(lease_s=-1.0)
    ledger.queue.release_dead()
    assert ledger.queue.claim_of(os.getpid())


@pytest.mark.parametrize(("lease_s", "kept"), [(3600.0, True), (-1.0, False)])
def test_pool_has_the_lease_to_decide_on_the_slot_of_an_ended_worker(
    tmp_path: Path, lease_s: float, kept: bool
) -> None:
    path = tmp_path / "ledger.sqlite"
    ledger = waiting_ledger(path)
    with subprocess.Popen(["true"]) as child:
        child.wait()
    assert ledger.queue.register_worker(1, lambda: child.pid)
    assert WorkQueue.open(path, child.pid).claim(lease_s=lease_s)
    ledger.queue.release_dead()
    assert (ledger.queue.claim_of(child.pid) is not None) == kept


def test_slot_is_given_back_at_once_if_worker_and_pool_have_ended(tmp_path: Path) -> None:
    path = tmp_path / "ledger.sqlite"
    ledger = waiting_ledger(path)
    with subprocess.Popen(["true"]) as child:
        child.wait()
    assert WorkQueue.open(path, child.pid).claim()
    ledger.queue.release_dead()
    assert ledger.queue.claim_of(child.pid) is None


def test_no_slot_flies_beside_a_repeated_one(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    first = ledger.queue.claim()
    assert first is not None
    ledger.queue.fly_alone(first, "died")
    again = ledger.queue.claim()
    assert again is not None
    assert (again.flight.slot.index, again.earlier_exits, again.attempt) == (
        first.flight.slot.index,
        "died",
        2,
    )
    assert ledger.queue.waiting() == 2
    assert ledger.queue.claim() is None
    ledger.queue.record(again, flight_result(), "", 0.0)
    beside = ledger.queue.claim()
    assert beside is not None
    assert beside.flight.slot.index == 1


def test_repeated_slot_waits_until_no_other_flies(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    first, other = ledger.queue.claim(), ledger.queue.claim()
    assert first is not None
    assert other is not None
    ledger.queue.fly_alone(first, "hung")
    assert ledger.queue.claim() is None
    ledger.queue.record(other, flight_result(), "", 0.0)
    again = ledger.queue.claim()
    assert again is not None
    assert again.flight == first.flight


def test_run_resumed_twice_counts_no_attempts_of_slots_in_flight(
    tmp_path: Path,
) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    for _ in range(2):
        claim = ledger.queue.claim()
        assert claim is not None
        assert (claim.flight.slot.index, claim.attempt) == (0, 1)
        ledger.close()
        ledger = Ledger.resume(tmp_path / "ledger.sqlite", FACTS)
    again = ledger.queue.claim()
    assert again is not None
    assert again.attempt == 1
    beside = ledger.queue.claim()
    assert beside is not None
    assert beside.flight.slot.index == 1


def test_used_worker_gets_slots_of_its_own_system_alone(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    ledger.add_search("t", "systems:Other", "court", 2, "{}")
    ledger.add_slots("t", 0, {0: "d", 1: "e"})
    first = ledger.queue.claim(flown="systems:Other")
    again = ledger.queue.claim(flown="systems:Other")
    assert first is not None
    assert again is not None
    assert [first.flight.key, again.flight.key] == [("t", 0, 0), ("t", 0, 1)]
    assert ledger.queue.claim(flown="systems:Other") is None
    assert ledger.queue.others_wait("systems:Other")
    assert not ledger.queue.others_wait("systems:Good")
    assert ledger.queue.claim(flown="systems:Good") is not None


def test_slots_of_a_low_priority_wait_behind_all_others(tmp_path: Path) -> None:
    ledger = waiting_ledger(tmp_path / "ledger.sqlite")
    behind = FlightId(search="behind", map="court")
    ledger.add_flight(behind, "systems:Good", "{}", "x", priority=BEHIND_SEARCHES)
    again = FlightId(search="again", map="court")
    ledger.add_flight(again, "systems:Good", "{}", "y")
    claims = [ledger.queue.claim() for _ in range(5)]
    order = [claim.flight.search for claim in claims if claim is not None]
    # A test waits for a flight that is repeated; it is flown with generation 0.
    assert order == ["again", "s", "s", "s", "behind"]
