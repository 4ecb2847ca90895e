from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.execution.worker_failure import WorkerExit, retry_or_record
from pytest_garl.flight.flight import Crash
from pytest_garl.scenarios.files import dump_scenario
from tests.execution.flying import Good, job_of, scenario
from tests.execution.ledgers import result_of
from tests.support.results import flight_result

DIED = WorkerExit(status=-11, stderr="no fuel")
KILLED = WorkerExit(status=-9)
BROKE = WorkerExit(status=0, failure=("TypeError", "no array", "Traceback"))
UNKNOWN = WorkerExit(
    status=0,
    failure=("LandingSystemError", "my:Lander cannot be imported by its name", "Traceback"),
)
HUNG = WorkerExit(status=-9, stacks="in step", hung="one call took longer than 30 s of wall time")


FIRST_FLIGHT = FlightId(search="s", map="lawn")


@pytest.fixture
def ledger(tmp_path: Path) -> Ledger:
    ledger = Ledger.create(tmp_path / "ledger.sqlite", {})
    job = job_of(Good, tmp_path / "flights")
    ledger.add_search("s", "flying:Good", "lawn", 2, job.dumps())
    ledger.add_slots("s", 0, {0: dump_scenario(scenario()), 1: dump_scenario(scenario(0.1))})
    return ledger


def claimed(ledger: Ledger) -> Claim:
    claim = ledger.queue.claim()
    assert claim is not None
    return claim


def crash(ledger: Ledger) -> Crash:
    result = result_of(ledger, FIRST_FLIGHT)
    assert result is not None
    assert result.crash is not None
    return result.crash


@pytest.mark.parametrize(
    ("ended", "after"), [(KILLED, "killed"), (HUNG, "hung"), (BROKE, "failed")]
)
def test_exit_that_the_machine_may_have_caused_is_flown_again_alone(
    ledger: Ledger, ended: WorkerExit, after: str
) -> None:
    first, other = claimed(ledger), claimed(ledger)
    retry_or_record(ledger.queue, first, ended)
    assert result_of(ledger, FIRST_FLIGHT) is None
    assert ledger.queue.claim() is None
    ledger.queue.record(other, flight_result(), "", 0.0)
    assert ledger.queue.claim(flown="m:Class") is None
    assert ledger.queue.alone_waits()
    again = claimed(ledger)
    assert (again.flight.slot.index, again.earlier_exits, again.attempt) == (0, after, 2)
    assert not ledger.queue.alone_waits()
    assert ledger.queries.meters()["retried"] == 1


def test_process_that_ends_itself_is_a_finding_at_once(ledger: Ledger) -> None:
    retry_or_record(ledger.queue, claimed(ledger), DIED)
    result = result_of(ledger, FIRST_FLIGHT)
    assert result is not None
    assert result.signature == "V:died:signal-11"
    assert crash(ledger).message == "its process ended with signal 11"
    assert crash(ledger).traceback == "no fuel"
    assert "retried" not in ledger.queries.meters()


@pytest.mark.parametrize(
    ("ended", "signature", "message"),
    [
        (KILLED, "V:died:signal-9", "its process ended with signal 9, twice"),
        (HUNG, "V:hung:Timeout", "one call took longer than 30 s of wall time, twice"),
        (
            BROKE,
            "V:broke:TypeError",
            "the simulator, which flies the reference pilot, failed with TypeError: no array, "
            "twice",
        ),
        (UNKNOWN, "V:broke:LandingSystemError", "my:Lander cannot be imported by its name, twice"),
    ],
)
def test_repeated_exit_is_a_finding(
    ledger: Ledger, ended: WorkerExit, signature: str, message: str
) -> None:
    first = claimed(ledger)
    ledger.queue.record(claimed(ledger), flight_result(), "", 0.0)
    retry_or_record(ledger.queue, first, ended)
    retry_or_record(ledger.queue, claimed(ledger), ended)
    result = result_of(ledger, FIRST_FLIGHT)
    assert result is not None
    assert result.signature == signature
    assert crash(ledger).message == message


def test_three_flights_with_different_exits_are_inconclusive(ledger: Ledger) -> None:
    first = claimed(ledger)
    ledger.queue.record(claimed(ledger), flight_result(), "", 0.0)
    retry_or_record(ledger.queue, first, HUNG)
    retry_or_record(ledger.queue, claimed(ledger), KILLED)
    third = claimed(ledger)
    assert (third.earlier_exits, third.attempt) == ("hung killed", 3)
    retry_or_record(ledger.queue, third, BROKE)
    result = result_of(ledger, FIRST_FLIGHT)
    assert result is not None
    assert (result.outcome, result.signature) == ("inconclusive", "")
    assert result.undecided.startswith("each of 3 flights ended its process in a different way")


def test_process_that_ends_itself_after_a_kill_is_a_finding(ledger: Ledger) -> None:
    first = claimed(ledger)
    ledger.queue.record(claimed(ledger), flight_result(), "", 0.0)
    retry_or_record(ledger.queue, first, KILLED)
    retry_or_record(ledger.queue, claimed(ledger), DIED)
    assert crash(ledger).message == "its process ended with signal 11"


def test_slot_that_is_given_back_counts_no_attempt(ledger: Ledger) -> None:
    first = claimed(ledger)
    ledger.queue.give_back(first)
    assert claimed(ledger) == first
    ledger.queue.record(claimed(ledger), flight_result(), "", 0.0)
    retry_or_record(ledger.queue, first, HUNG)
    alone = claimed(ledger)
    assert (alone.earlier_exits, alone.attempt) == ("hung", 2)
    ledger.queue.give_back(alone)
    assert claimed(ledger) == alone
    ledger.queue.release(alone.pid)
    assert claimed(ledger) == alone
