from __future__ import annotations

import dataclasses
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from pytest_garl.errors import PoolError
from pytest_garl.execution.flight import fly_job
from pytest_garl.execution.job import dump_scenario, loads
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.execution.ray.actor import ActorWorkspace, FlightActor, FlightOutput
from pytest_garl.execution.reference import Reference, reference_to
from pytest_garl.execution.worker_failure import WorkerExit
from pytest_garl.simulation.flight_file import load
from tests.execution.flying import Exits, Good, Loud, Reports, Sleeps, Slow, job_of, scenario
from tests.plugin.test_plugin import write_project


def claim(system: type, after: str = "", timeout_s: float = 10.0) -> Claim:
    return Claim(
        search="0123456789",
        generation=3,
        slot=7,
        scenario=dump_scenario(scenario(0.2)),
        job=job_of(system, Path("/nowhere/flights"), timeout_s).dumps(),
        after=after,
        attempt=2 if after else 1,
        pid=os.getpid(),
    )


@pytest.fixture
def pilot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FlightActor]:
    monkeypatch.chdir(Path(__file__).parents[2])
    pilot = FlightActor(ActorWorkspace(scratch=str(tmp_path)))
    yield pilot
    pilot.close()
    assert not list(tmp_path.glob(".garl-pilot-*"))


def test_a_pilot_flies_what_a_child_of_the_local_pool_would(
    pilot: FlightActor, tmp_path: Path
) -> None:
    job = job_of(Good, tmp_path / "local")
    local, sha256, _ = fly_job(job, scenario(0.2), "flight", None)
    found = pilot.fly(claim(Good))
    assert isinstance(found, FlightOutput)
    assert (found.result, found.sha256) == (json.loads(json.dumps(local)), sha256)
    (tmp_path / "came.npz").write_bytes(found.record)
    assert load(tmp_path / "came.npz").sha256 == load(tmp_path / "local" / "flight.npz").sha256


def test_a_pilot_outlives_what_it_flies(pilot: FlightActor) -> None:
    ended = pilot.fly(claim(Exits))
    assert ended == WorkerExit(status=3, stderr="no fuel\n")
    assert isinstance(pilot.fly(claim(Good)), FlightOutput)


def test_a_traceback_on_stderr_is_the_landing_systems_own(pilot: FlightActor) -> None:
    ended = pilot.fly(claim(Reports))
    assert isinstance(ended, WorkerExit)
    assert (ended.status, ended.cause) == (1, "died")


def test_a_simulator_that_fails_is_no_death_of_the_landing_system(pilot: FlightActor) -> None:
    job = loads(claim(Good).job)
    broken = dataclasses.replace(job, simulator=reference_to(scenario))
    first = pilot.fly(dataclasses.replace(claim(Good), job=broken.dumps()))
    assert isinstance(first, WorkerExit)
    assert first.cause == "failed"
    again = dataclasses.replace(claim(Good, after="failed"), job=broken.dumps())
    with pytest.raises(PoolError, match=r"^the simulator failed in a worker process:\nTraceback"):
        pilot.fly(again)


def test_a_call_that_hangs_is_told_from_a_death(pilot: FlightActor) -> None:
    ended = pilot.fly(claim(Sleeps, timeout_s=0.3))
    assert isinstance(ended, WorkerExit)
    assert ended.hung == "one call took longer than 0.3 s of wall time"
    assert "in step" in ended.stacks


def test_a_flight_that_hung_before_has_three_times_the_time_and_counts(pilot: FlightActor) -> None:
    """A machine that is slow once changes nothing that the search learns from."""
    found, calm = pilot.fly(claim(Slow, after="hung", timeout_s=1.0)), pilot.fly(claim(Slow))
    assert isinstance(found, FlightOutput)
    assert isinstance(calm, FlightOutput)
    assert (found.result, found.sha256) == (calm.result, calm.sha256)


def test_a_system_that_says_much_is_not_taken_for_one_that_hangs(pilot: FlightActor) -> None:
    assert all(isinstance(pilot.fly(claim(Loud, timeout_s=5.0)), FlightOutput) for _ in range(3))


def test_a_pilot_in_a_copy_of_the_project_tells_of_home(
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
    pilot = FlightActor(ActorWorkspace(home=str(home), inside="inside"))
    assert list(copy.glob(".garl-pilot-*"))
    try:
        found = pilot.fly(dataclasses.replace(claim(Good), job=job.dumps()))
    finally:
        pilot.close()
    assert Path.cwd() == copy / "inside"
    assert isinstance(found, FlightOutput)
    assert found.result.crash is not None
    assert found.result.crash.message == "no plan"
    assert f'File "{home}/systems.py"' in found.result.crash.traceback
    assert str(copy) not in found.result.dumps()
