from __future__ import annotations

import dataclasses
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from pytest_garl.errors import PoolError
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.fly_and_judge import fly_job
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.execution.ray.actor import ActorWorkspace, FlightActor, FlightOutput
from pytest_garl.execution.reference import Reference, reference_to
from pytest_garl.execution.worker_failure import WorkerExit
from pytest_garl.flight.flight_file import load
from pytest_garl.scenarios.files import dump_scenario
from tests.execution.flying import Exits, Good, Loud, Reports, Sleeps, Slow, job_of, scenario
from tests.support.landing_project import write_project


def claim(system: type, earlier_exits: str = "", timeout_s: float = 10.0) -> Claim:
    return Claim(
        flight=FlightId(search="0123456789", map="lawn", slot=Slot(generation=3, index=7)),
        scenario=dump_scenario(scenario(0.2)),
        job=job_of(system, Path("/nowhere/flights"), timeout_s).dumps(),
        earlier_exits=earlier_exits,
        attempt=2 if earlier_exits else 1,
        pid=os.getpid(),
    )


@pytest.fixture
def actor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FlightActor]:
    monkeypatch.chdir(Path(__file__).parents[2])
    actor = FlightActor(ActorWorkspace(scratch=str(tmp_path)))
    yield actor
    actor.close()
    assert not list(tmp_path.glob(".garl-actor-*"))


def test_actor_flies_the_same_bytes_as_a_local_worker(actor: FlightActor, tmp_path: Path) -> None:
    job = job_of(Good, tmp_path / "local")
    flight = FlightId(search="flight", map="lawn")
    local, sha256, _ = fly_job(job, scenario(0.2), flight, None)
    found = actor.fly(claim(Good))
    assert isinstance(found, FlightOutput)
    assert (found.result, found.sha256) == (local, sha256)
    (tmp_path / "came.npz").write_bytes(found.record)
    assert load(tmp_path / "came.npz").sha256 == load(job.record(flight)).sha256


def test_actor_survives_the_end_of_its_worker(actor: FlightActor) -> None:
    ended = actor.fly(claim(Exits))
    assert ended == WorkerExit(status=3, stderr="no fuel\n")
    assert isinstance(actor.fly(claim(Good)), FlightOutput)


def test_traceback_on_stderr_belongs_to_the_landing_system(actor: FlightActor) -> None:
    ended = actor.fly(claim(Reports))
    assert isinstance(ended, WorkerExit)
    assert (ended.status, ended.cause) == (1, "died")


def test_failure_of_the_simulator_is_no_failure_of_the_landing_system(actor: FlightActor) -> None:
    job = parse_job(claim(Good).job)
    broken = dataclasses.replace(job, simulator=reference_to(scenario))
    first = actor.fly(dataclasses.replace(claim(Good), job=broken.dumps()))
    assert isinstance(first, WorkerExit)
    assert first.cause == "failed"
    again = dataclasses.replace(claim(Good, earlier_exits="failed"), job=broken.dumps())
    with pytest.raises(PoolError, match=r"^the simulator failed in a worker process:\nTraceback"):
        actor.fly(again)


def test_call_that_hangs_is_reported_with_its_stacks(actor: FlightActor) -> None:
    ended = actor.fly(claim(Sleeps, timeout_s=0.3))
    assert isinstance(ended, WorkerExit)
    assert ended.hung == "one call took longer than 0.3 s of wall time"
    assert "in step" in ended.stacks


def test_flight_that_hung_before_gets_three_times_the_limit(actor: FlightActor) -> None:
    """If a machine is slow once, the search learns the same."""
    found, calm = (
        actor.fly(claim(Slow, earlier_exits="hung", timeout_s=1.0)),
        actor.fly(claim(Slow)),
    )
    assert isinstance(found, FlightOutput)
    assert isinstance(calm, FlightOutput)
    assert (found.result, found.sha256) == (calm.result, calm.sha256)


def test_system_that_writes_much_does_not_hang(actor: FlightActor) -> None:
    assert all(isinstance(actor.fly(claim(Loud, timeout_s=5.0)), FlightOutput) for _ in range(3))


def test_actor_in_a_copy_of_the_project_reports_local_paths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, copy = tmp_path / "home", tmp_path / "copy"
    (home / "inside").mkdir(parents=True)
    write_project(home)
    shutil.move(home, copy)
    job = dataclasses.replace(
        job_of(Good, home / "flights"),
        system=Reference(module="systems", file=f"{home}/systems.py", qualname="Raises"),
        simulator=Reference(
            module="tiny_simulator", file=f"{home}/tiny_simulator.py", qualname="fly"
        ),
        path=(str(home),),
    )
    monkeypatch.chdir(copy)
    actor = FlightActor(ActorWorkspace(project=str(home), working_dir="inside"))
    assert list(copy.glob(".garl-actor-*"))
    try:
        found = actor.fly(dataclasses.replace(claim(Good), job=job.dumps()))
    finally:
        actor.close()
    assert Path.cwd() == copy / "inside"
    assert isinstance(found, FlightOutput)
    assert found.result.crash is not None
    assert found.result.crash.message == "no plan"
    assert f'File "{home}/systems.py"' in found.result.crash.traceback
    assert str(copy) not in found.result.dumps()
