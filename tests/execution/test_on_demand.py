from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.reference import reference_to
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.execution.flying import Good, job_of, scenario


@pytest.fixture
def job(tmp_path: Path) -> FlightJob:
    return job_of(Good, tmp_path / "flights")


@pytest.fixture
def ledger(tmp_path: Path) -> Ledger:
    return Ledger.create(tmp_path / "ledger.sqlite", {})


POOLS: list[Pool] = []


@pytest.fixture(autouse=True)
def _end_of_pools() -> Iterator[None]:
    yield
    while POOLS:
        POOLS.pop().close()


def on_demand(ledger: Ledger, on_wait: Callable[[], None] = lambda: None) -> OnDemandFlights:
    POOLS.append(local_pool(ledger.queue, workers=0))
    return OnDemandFlights(ledger, POOLS[-1], on_wait)


def foggier(job: FlightJob) -> Callable[[FlyFunction], tuple[float, str]]:
    """Return a procedure that asks for one flight after the other."""

    def procedure(fly: FlyFunction) -> tuple[float, str]:
        fog = 0.0
        while not (done := fly(job, scenario(fog))).signature:
            fog = round(fog + 0.04, 2)
        return fog, done.signature

    return procedure


def test_procedure_decides_on_each_flight_by_the_one_before(job: FlightJob, ledger: Ledger) -> None:
    found = on_demand(ledger).run({"one": foggier(job), "two": foggier(job)})
    assert found == {"one": (0.12, "I:nothing:unseen"), "two": (0.12, "I:nothing:unseen")}
    assert ledger.queries.meters()["on_demand"] == 8
    # These flights are not part of a search's figures.
    assert ledger.queries.flights() == []
    assert ledger.queries.progress() == []


def test_repeated_question_reads_the_ledger_and_flies_nothing(
    job: FlightJob, ledger: Ledger
) -> None:
    first = on_demand(ledger).run({"one": foggier(job)})
    assert on_demand(ledger).run({"one": foggier(job)}) == first
    assert ledger.queries.meters()["on_demand"] == 4


def test_flight_has_its_hash_and_its_record(job: FlightJob, ledger: Ledger) -> None:
    done: CompletedFlight = on_demand(ledger).run({"x": lambda fly: fly(job, scenario(0.0))})["x"]
    assert done.record.is_file()
    assert len(done.sha256) == 64
    assert done.result.outcome == "landed"


def test_job_chooses_the_system(job: FlightJob, ledger: Ledger) -> None:
    pilot = dataclasses.replace(job, system=reference_to(ReferencePilot))

    def procedure(fly: FlyFunction) -> tuple[str, str]:
        return fly(job, scenario(0.14)).signature, fly(pilot, scenario(0.14)).signature

    assert on_demand(ledger).run({"x": procedure}) == {"x": ("I:nothing:unseen", "")}


def test_error_in_one_procedure_ends_the_others(job: FlightJob, ledger: Ledger) -> None:
    def fails(fly: FlyFunction) -> tuple[float, str]:
        raise ZeroDivisionError("no plan")

    before = threading.active_count()
    with pytest.raises(ZeroDivisionError, match="no plan"):
        on_demand(ledger).run({"one": foggier(job), "two": fails})
    assert threading.active_count() <= before


def test_interruption_ends_the_threads_and_loses_no_flight(job: FlightJob, ledger: Ledger) -> None:
    turns = iter(range(1))

    def interrupt() -> None:
        if next(turns, None) is None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        on_demand(ledger, interrupt).run({"one": foggier(job)})
    flown = ledger.queries.meters()["on_demand"]
    assert 0 < flown < 4
    assert on_demand(ledger).run({"one": foggier(job)})["one"][0] == 0.12
    assert ledger.queries.meters()["on_demand"] == 4


def test_flights_of_a_procedure_that_was_stopped_are_counted(
    job: FlightJob, ledger: Ledger
) -> None:
    flights = on_demand(ledger)
    flights.start("one", foggier(job))
    while flights.flown < 2:
        flights.turn()
    flights.close()
    assert flights.flown == 2


def test_signal_before_a_thread_has_started_ends_the_run(
    job: FlightJob, ledger: Ledger, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(thread: threading.Thread) -> None:
        raise SystemExit(143)

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(SystemExit, match="143"):
        on_demand(ledger).run({"one": foggier(job)})
