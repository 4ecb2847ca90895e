from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.baselines.record import BaselineSpec
from pytest_garl.errors import LedgerError
from pytest_garl.execution.batch import fly_all, temporary_pool
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import Reference
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.verdicts.verdict import Limits
from tests.execution.flying import Good, Replaces, job_of, scenario
from tests.support.results import flight_result

JOB = FlightJob.for_system(
    Reference(module="stack", file="", qualname="Lander"),
    load_map("lawn"),
    policy_spec("waypoint"),
    system_sha256="one",
    path=(),
    flights=Path("flights"),
)
SCENARIOS = BaselineSpec(count=3).scenarios(load_map("lawn"))


class Instant:
    """Flies nothing; remembers what had been handed out when the first flight was awaited."""

    def __init__(self, ledger: Ledger) -> None:
        self.ledger = ledger
        self.handed_out: list[str] = []

    def turn(self) -> None:
        claim = self.ledger.queue.claim()
        assert claim is not None
        if not self.handed_out:
            self.handed_out = [text for text, _ in self.ledger.generation(claim.flight.search, 0)]
        self.ledger.queue.record(claim, flight_result(elapsed_s=claim.flight.slot.index), "", 0.0)

    def close(self) -> None:
        pass


@pytest.fixture
def pool(tmp_path: Path) -> Instant:
    return Instant(Ledger.create(tmp_path / "ledger.sqlite", {}))


def fly(pool: Instant, job: FlightJob = JOB, count: int = 3) -> list[float]:
    flights = fly_all(pool.ledger, pool, job, SCENARIOS[:count])
    return [done.result.elapsed_s for done in flights]


def test_all_flights_are_handed_out_before_the_first_is_awaited(pool: Instant) -> None:
    assert fly(pool) == [0, 1, 2]
    assert pool.handed_out == [dump_scenario(each) for each in SCENARIOS]


def test_flights_beside_a_search_count_as_none(pool: Instant) -> None:
    fly(pool)
    assert pool.ledger.queries.progress() == []
    assert pool.ledger.searches() == []


def test_a_resumed_batch_must_be_of_the_same_system_but_others_do_not_matter(
    pool: Instant,
) -> None:
    fly(pool)
    changed = dataclasses.replace(JOB, system_sha256="two")
    with pytest.raises(
        LedgerError, match=r"stack:Lander on lawn flew .* but system_sha256 changed"
    ):
        fly(pool, changed)
    assert fly(pool, changed, count=2) == [0, 1]


@pytest.mark.parametrize(
    ("change", "differing"),
    [
        ({"limits": Limits(distance_m=1.0)}, ("limits",)),
        ({"limits": Limits(abort="violation")}, ("limits",)),
        ({"map_sha256": "two"}, ("map_sha256",)),
        ({"timeout_s": 5.0}, ("timeout_s",)),
        ({"path": ("elsewhere",), "flights": "there", "map_folders": ("maps",)}, ()),
    ],
)
def test_jobs_differ_in_what_is_flown_and_not_in_where_it_lies(
    change: dict[str, Any], differing: tuple[str, ...]
) -> None:
    assert JOB.differences(dataclasses.replace(JOB, **change)) == differing


def test_what_one_system_replaces_in_its_process_bends_no_flight_of_another(tmp_path: Path) -> None:
    with temporary_pool(1) as (ledger, pool):

        def hash_of(system: type, distance_m: float) -> str:
            # Limits of their own make a search of their own.
            job = dataclasses.replace(
                job_of(system, tmp_path), limits=Limits(distance_m=distance_m)
            )
            return next(fly_all(ledger, pool, job, [scenario()])).sha256

        before = hash_of(Good, 1.0)
        assert hash_of(Replaces, 1.0) == "bent"
        assert hash_of(Good, 2.0) == before
