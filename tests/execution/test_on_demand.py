from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.execution.reference import reference_to
from pytest_garl.execution.result import CompletedFlight
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.execution.flying import Good, job_of, scenario


@pytest.fixture
def job(tmp_path: Path) -> FlightJob:
    return job_of(Good, tmp_path / "flights")


@pytest.fixture
def ledger(tmp_path: Path) -> Ledger:
    return Ledger.create(tmp_path / "ledger.sqlite", {})


def errands(ledger: Ledger, tick: Callable[[], None] = lambda: None) -> OnDemandFlights:
    return OnDemandFlights(ledger, local_pool(ledger.queue, workers=0), tick)


def foggier(job: FlightJob) -> Callable[[FlyFunction], tuple[float, str]]:
    """Return a train of thought that asks for one flight after the other."""

    def think(fly: FlyFunction) -> tuple[float, str]:
        fog = 0.0
        while not (done := fly(job, scenario(fog))).signature:
            fog = round(fog + 0.04, 2)
        return fog, done.signature

    return think


def test_each_flight_is_decided_by_the_one_before(job: FlightJob, ledger: Ledger) -> None:
    found = errands(ledger).run({"one": foggier(job), "two": foggier(job)})
    assert found == {"one": (0.12, "I?:unknown"), "two": (0.12, "I?:unknown")}
    assert ledger.queries.meters()["on_demand"] == 8
    # They are no part of any search's figures.
    assert ledger.queries.results() == []
    assert ledger.queries.progress() == []


def test_what_was_flown_is_not_flown_again_when_asked_anew(job: FlightJob, ledger: Ledger) -> None:
    first = errands(ledger).run({"one": foggier(job)})
    assert errands(ledger).run({"one": foggier(job)}) == first
    assert ledger.queries.meters()["on_demand"] == 4


def test_a_result_comes_with_its_hash_and_its_record(job: FlightJob, ledger: Ledger) -> None:
    done: CompletedFlight = errands(ledger).run({"x": lambda fly: fly(job, scenario(0.0))})["x"]
    assert done.record.is_file()
    assert len(done.sha256) == 64
    assert done.result.outcome == "landed"


def test_another_job_flies_another_system(job: FlightJob, ledger: Ledger) -> None:
    import dataclasses

    pilot = dataclasses.replace(job, system=reference_to(ReferencePilot))

    def think(fly: FlyFunction) -> tuple[str, str]:
        return fly(job, scenario(0.14)).signature, fly(pilot, scenario(0.14)).signature

    assert errands(ledger).run({"x": think}) == {"x": ("I?:unknown", "")}


def test_an_error_in_one_ends_the_others(job: FlightJob, ledger: Ledger) -> None:
    def fails(fly: FlyFunction) -> tuple[float, str]:
        raise ZeroDivisionError("no plan")

    before = threading.active_count()
    with pytest.raises(ZeroDivisionError, match="no plan"):
        errands(ledger).run({"one": foggier(job), "two": fails})
    assert threading.active_count() <= before


def test_an_interruption_ends_the_threads_and_loses_nothing(job: FlightJob, ledger: Ledger) -> None:
    ticks = iter(range(1))

    def tick() -> None:
        if next(ticks, None) is None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        errands(ledger, tick).run({"one": foggier(job)})
    flown = ledger.queries.meters()["on_demand"]
    assert 0 < flown < 4
    assert errands(ledger).run({"one": foggier(job)})["one"][0] == 0.12
    assert ledger.queries.meters()["on_demand"] == 4
