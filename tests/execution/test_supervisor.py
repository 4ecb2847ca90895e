from __future__ import annotations

import dataclasses
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import PoolError
from pytest_garl.execution.flight_id import FIRST_SLOT, FlightId, Slot
from pytest_garl.execution.fly_and_judge import fly_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import MAX_IDLE_EXITS, FlightWorkers, ProcessPool
from pytest_garl.execution.pool import wait_for
from pytest_garl.execution.reference import reference_to
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.supervisor import LEAST_STANDSTILL_S, FlightMonitor
from pytest_garl.flight.flight import Crash
from pytest_garl.scenarios.files import dump_scenario
from tests.execution.flying import Exits, Good, Slow, job_of, scenario
from tests.execution.ledgers import result_of, sha256_of
from tests.execution.misbehaving import (
    ClosesFiles,
    DiesOnce,
    Floods,
    Forks,
    HoldsTheLock,
    KeepsTheLedgerLocked,
    KilledOnce,
    LeavesLock,
    LeavesProcesses,
    LeavesTheLedgerLocked,
    OpensNoDatabase,
    OpensNothing,
    Pretends,
    PretendsToZeros,
    ReplacesZeros,
    SavesNothing,
    StopsClocks,
    StopsItsSupervisor,
    WillNotEnd,
    left,
)
from tests.support import tiny_simulator


@dataclasses.dataclass(frozen=True, kw_only=True)
class Flown:
    """The result of a system's flight, and of a good system's flight after it."""

    result: FlightResult
    sha256: str
    neighbour: str
    meters: dict[str, float]

    @property
    def signature(self) -> str:
        return self.result.signature


def flight_of(search: str, slot: Slot = FIRST_SLOT) -> FlightId:
    return FlightId(search=search, map="lawn", slot=slot)


def crash_of(flown: Flown) -> Crash:
    assert flown.result.crash is not None
    return flown.result.crash


class Field:
    """A ledger and a pool of one worker: what one flight leaves, the next one meets."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.ledger = Ledger.create(folder / "ledger.sqlite", {})
        self.pool = ProcessPool(self.ledger.queue, FlightWorkers(max_workers=1, shutdown_s=60.0))

    def fly(self, system: type, timeout_s: float = 20.0, simulator: Any = None) -> Flown:
        """Fly a system and then a good one."""
        flights = self.folder / "flights"
        job = job_of(system, flights, timeout_s)
        if simulator:
            job = dataclasses.replace(job, simulator=reference_to(simulator))
        for search, each in (("bad", job), ("good", job_of(Good, flights, 20.0))):
            self.ledger.add_search(search, each.system.name, "lawn", 1, each.dumps())
        self.ledger.add_slots("bad", 0, {0: dump_scenario(scenario())})
        self.ledger.add_slots("good", 1, {0: dump_scenario(scenario(0.2))})
        for search, slot in (("bad", Slot(generation=0, index=0)), ("good", NEXT)):
            wait_for(self.ledger, self.pool, flight_of(search, slot), flights, lambda: None)
        result = result_of(self.ledger, flight_of("bad"))
        assert result is not None
        return Flown(
            result=result,
            sha256=sha256_of(self.ledger, flight_of("bad")),
            neighbour=sha256_of(self.ledger, flight_of("good", NEXT)),
            meters=self.ledger.queries.meters(),
        )


NEXT = Slot(generation=1, index=0)


@pytest.fixture
def field(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Field]:
    monkeypatch.chdir(tmp_path)
    field = Field(tmp_path)
    yield field
    field.pool.close()
    field.ledger.close()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the hash of the good system's flight."""
    flights = tmp_path_factory.mktemp("undisturbed")
    return fly_job(job_of(Good, flights), scenario(0.2), flight_of("flight"), None)[1]


@pytest.mark.parametrize(
    ("system", "lines"), [(HoldsTheLock, ["misbehaving.py", "in step"]), (StopsClocks, [])]
)
def test_call_that_hangs_is_a_finding_with_its_line_even_if_it_harms_the_process(
    field: Field, undisturbed: str, system: type, lines: list[str]
) -> None:
    flown = field.fly(system, timeout_s=0.5)
    assert flown.signature == "V:hung:Timeout"
    assert crash_of(flown).message == ("one call took longer than 1.5 s of wall time, twice")
    assert flown.neighbour == undisturbed
    assert all(each in crash_of(flown).traceback for each in lines)


def works_between_calls(*args: Any, guard: Any, **more: Any) -> Any:
    """Take long where no landing system is called, as the painting of the ground does."""
    guard.step_begins()
    guard.step_ends()
    time.sleep(2.5)
    return tiny_simulator.fly(*args, guard=guard, **more)


def records_no_samples(*args: Any, **more: Any) -> Any:
    """Return a flight that can be saved and not be read."""
    flight = tiny_simulator.fly(*args, **more)
    track = flight.uav
    empty = dataclasses.replace(track, **{name: getattr(track, name)[:0] for name in TRACK})
    return dataclasses.replace(flight, uav=empty)


TRACK = ("time_s", "position_m", "attitude", "velocity_mps")


def test_simulator_whose_records_cannot_be_judged_ends_the_run(field: Field) -> None:
    with pytest.raises(PoolError, match=r"0\.time_s: found no times, expected at least one"):
        field.fly(Good, simulator=records_no_samples)


def has_a_hash_that_no_file_takes(*args: Any, **more: Any) -> Any:
    """Return a flight whose result cannot be written."""
    return dataclasses.replace(tiny_simulator.fly(*args, **more), sha256="\ud800")


def test_an_error_of_what_judges_ends_the_run(field: Field) -> None:
    words = r"(?s)the judge of flights failed in a worker process.*UnicodeEncodeError"
    with pytest.raises(PoolError, match=words):
        field.fly(Good, simulator=has_a_hash_that_no_file_takes)


def raises_at_length(*args: Any, **more: Any) -> Any:
    raise ValueError("ж" * 30_000)


def test_simulator_that_fails_with_a_long_text_ends_the_run_with_it(field: Field) -> None:
    with pytest.raises(PoolError, match="ValueError: жжж"):
        field.fly(Good, simulator=raises_at_length)


def test_limit_of_a_call_ignores_the_simulators_time(field: Field) -> None:
    flown = field.fly(Good, timeout_s=2.0, simulator=works_between_calls)
    assert flown.result.outcome == "landed"
    assert "retried" not in flown.meters


def test_slow_flight_is_repeated_with_more_time_and_counts(field: Field, tmp_path: Path) -> None:
    flown = field.fly(Slow, timeout_s=1.0)
    calm, sha256, _ = fly_job(
        job_of(Slow, tmp_path / "calm"), scenario(), flight_of("flight"), None
    )
    assert (flown.result, flown.sha256) == (calm, sha256)
    assert flown.meters["retried"] == 1


def test_process_that_dies_once_is_a_finding(field: Field, undisturbed: str) -> None:
    flown = field.fly(DiesOnce)
    assert flown.signature == "V:died:signal-11"
    assert "in step" in crash_of(flown).traceback
    assert "retried" not in flown.meters
    assert flown.neighbour == undisturbed


def test_process_that_dies_leaves_no_record_of_an_earlier_run(field: Field) -> None:
    flights = field.folder / "flights"
    flights.mkdir()
    stale = flight_of("bad").record(flights)
    stale.write_bytes(b"of an earlier run")
    assert field.fly(Exits).signature == "V:died:exit-status-3"
    assert not stale.exists()
    assert (flight_of("good", NEXT).record(flights)).is_file()


def test_killed_process_is_flown_again(field: Field) -> None:
    flown = field.fly(KilledOnce)
    assert flown.signature == ""
    assert flown.meters["retried"] == 1


def test_landing_system_cannot_report_that_the_run_must_end(field: Field, undisturbed: str) -> None:
    flown = field.fly(Pretends)
    assert flown.signature == "V:died:exit-status-86"
    assert flown.neighbour == undisturbed


def test_processes_started_in_a_flight_end_with_it(field: Field, undisturbed: str) -> None:
    flown = field.fly(LeavesProcesses)
    assert flown.signature == ""
    assert flown.neighbour == undisturbed
    # The neighbour flew in the next process, which was started when all of these had ended.
    assert left("misbehaving.py") == set()


def test_stopped_supervisor_is_a_finding(
    field: Field, undisturbed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pytest_garl.execution.local_pool.LEAST_SILENCE_S", 1.5)
    flown = field.fly(StopsItsSupervisor, timeout_s=0.2)
    assert flown.signature == "V:hung:Timeout"
    stood_still = "the process that watches it stood still for 1.8 s of wall time, twice"
    assert crash_of(flown).message == stood_still
    assert flown.neighbour == undisturbed


@pytest.mark.parametrize("system", [LeavesTheLedgerLocked, KeepsTheLedgerLocked])
def test_lock_that_a_flight_leaves_ends_no_run(
    field: Field, undisturbed: str, system: type
) -> None:
    flown = field.fly(system)
    assert flown.signature == ""
    assert flown.neighbour == undisturbed


def test_system_that_forks_is_flown_once(field: Field, undisturbed: str) -> None:
    flown = field.fly(Forks)
    assert flown.signature == ""
    assert flown.meters["flights"] == 2
    assert flown.neighbour == undisturbed


@pytest.mark.parametrize(
    ("system", "signature"),
    [
        (ClosesFiles, ""),
        (OpensNothing, "V:broke:LedgerError"),
        (ReplacesZeros, "V:broke:TypeError"),
        (PretendsToZeros, ""),
        (SavesNothing, "V:broke:GarlError"),
        (OpensNoDatabase, ""),
        (Floods, ""),
        (WillNotEnd, ""),
    ],
)
def test_harm_to_the_process_changes_no_other_flight(
    field: Field, undisturbed: str, system: type, signature: str
) -> None:
    flown = field.fly(system)
    assert flown.signature == signature
    assert flown.neighbour == undisturbed


def test_reference_pilot_proves_the_simulator_after_a_failure(
    field: Field,
) -> None:
    message = crash_of(field.fly(ReplacesZeros)).message
    assert message.startswith("the simulator, which flies the reference pilot, failed with TypeE")


def test_workers_end_on_request_after_any_flight(tmp_path: Path) -> None:
    field = Field(tmp_path)
    field.fly(WillNotEnd)
    workers = [worker.process for worker in field.pool._workers.values()]
    field.pool.close()
    # Nobody had to kill it.
    assert [worker.returncode for worker in workers] == [0]
    field.ledger.close()


def test_workers_that_end_between_flights_do_not_end_the_run(field: Field) -> None:
    job = job_of(Good, field.folder / "flights")
    field.ledger.add_search("one", job.system.name, "lawn", 9, job.dumps())
    for index in range(MAX_IDLE_EXITS + 2):
        field.ledger.add_slots("one", index, {0: dump_scenario(scenario())})
        slot = Slot(generation=index, index=0)
        wait_for(field.ledger, field.pool, flight_of("one", slot), field.folder, lambda: None)
        (worker,) = field.pool._workers
        os.kill(worker, signal.SIGKILL)
        while worker in field.pool._workers:
            field.pool.turn()
    assert field.ledger.queries.meters()["flights"] == MAX_IDLE_EXITS + 2


def test_workers_that_end_before_they_fly_end_the_run(field: Field) -> None:
    def kill_all() -> None:
        for worker in field.pool._workers:
            os.kill(worker, signal.SIGKILL)

    field.ledger.add_search("one", "s", "lawn", 1, "{}")
    with pytest.raises(PoolError, match="worker processes end before they fly"):
        wait_for(field.ledger, field.pool, flight_of("one", NEXT), field.folder, kill_all)


def test_pool_leaves_no_files_beside_the_ledger(tmp_path: Path) -> None:
    field = Field(tmp_path)
    field.fly(Good)
    field.pool.close()
    field.ledger.close()
    assert {path.name for path in tmp_path.iterdir()} == {"ledger.sqlite", "flights"}


def test_unchanged_process_flies_on(field: Field) -> None:
    field.fly(Good)
    (first,) = field.pool._workers
    job = job_of(Good, field.folder)
    field.ledger.add_search("more", job.system.name, "lawn", 4, job.dumps())
    field.ledger.add_slots("more", 2, {index: dump_scenario(scenario()) for index in range(4)})
    for index in range(4):
        wait_for(
            field.ledger,
            field.pool,
            flight_of("more", Slot(generation=2, index=index)),
            field.folder,
            lambda: None,
        )
    assert list(field.pool._workers) == [first]


def test_limit_applies_to_calls_until_the_flight_stands_still(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 1000.0
    monkeypatch.setattr("pytest_garl.execution.supervisor.monotonic", lambda: now)
    monkeypatch.setattr("pytest_garl.execution.supervisor.os.write", lambda *_: 0)
    monitor = FlightMonitor()
    assert monitor.overdue() == ""
    monitor.flight_begins(2.0)
    now += 60.0
    assert monitor.overdue() == ""
    monitor.step_begins()
    now += 1.9
    assert monitor.overdue() == ""
    now += 0.2
    assert monitor.overdue() == "one call took longer than 2 s of wall time"
    monitor.step_ends()
    now += LEAST_STANDSTILL_S - 1
    assert monitor.overdue() == ""
    now += 2
    assert monitor.overdue() == "neither it nor the simulator went on for 120 s"
    monitor.flight_ends()
    assert monitor.overdue() == ""


@pytest.mark.long
def test_thread_that_holds_the_interpreter_between_calls_is_a_finding(
    field: Field, undisturbed: str
) -> None:
    flown = field.fly(LeavesLock)
    assert flown.signature == "V:hung:Timeout"
    assert flown.neighbour == undisturbed
