from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.engine import VARIABLE
from pytest_garl.errors import LedgerError
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.reference import Reference
from pytest_garl.gate.record import BaselineSpec
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.verdicts.verdict import Limits
from tests.execution.flying import Good, Replaces, job_of, scenario
from tests.support.blind_lander import job_of as job_of_blind_lander
from tests.support.blind_lander import scenario_with
from tests.support.engines import NEEDS_MUJOCO
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
    """Flies nothing; remembers the slots that waited at its first turn."""

    in_process = False

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


def test_batch_hands_out_all_flights_before_it_waits(pool: Instant) -> None:
    assert fly(pool) == [0, 1, 2]
    assert pool.handed_out == [dump_scenario(each) for each in SCENARIOS]


def test_batch_is_no_search(pool: Instant) -> None:
    fly(pool)
    assert pool.ledger.queries.progress() == []
    assert pool.ledger.searches() == []


def test_resumed_batch_refuses_another_version_of_the_system(
    pool: Instant,
) -> None:
    fly(pool)
    changed = dataclasses.replace(JOB, system_sha256="two")
    with pytest.raises(
        LedgerError, match=r"stack:Lander on lawn flew .* but system_sha256 changed"
    ):
        fly(pool, changed)
    assert fly(pool, changed, count=2) == [0, 1]


def test_flight_does_not_see_replacements_by_another_system(tmp_path: Path) -> None:
    with temporary_pool(1) as (ledger, pool):

        def hash_of(system: type, distance_m: float) -> str:
            # Other limits make another search.
            job = dataclasses.replace(
                job_of(system, tmp_path), limits=Limits(distance_m=distance_m)
            )
            return next(fly_all(ledger, pool, job, [scenario()])).sha256

        before = hash_of(Good, 1.0)
        assert hash_of(Replaces, 1.0) == "bent"
        assert hash_of(Good, 2.0) == before


@NEEDS_MUJOCO
@pytest.mark.sim
def test_flights_by_mujoco_are_the_same_with_one_worker_and_with_two(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "mujoco")
    job = job_of_blind_lander("waypoint", tmp_path)
    assert job.engine == "mujoco"
    scenarios = [scenario_with("dog-1", velocity) for velocity in (0.2, 1.0)]

    def hashes(workers: int) -> list[str]:
        with temporary_pool(workers) as (ledger, pool):
            return [done.sha256 for done in fly_all(ledger, pool, job, scenarios)]

    first = hashes(1)
    assert "" not in first
    assert hashes(2) == first
