"""Flights of this process are judged in another one."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl.errors import GarlError, NotFiniteError, PoolError
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.fly_and_judge import FlownJob, fly_and_save, fly_job, judged
from pytest_garl.execution.judge_process import JudgeProcess
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import local_pool, temporary_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.reference import reference_to
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.process_tree import alive, descendants_of
from pytest_garl.simulation.system_under_test.calls import crash_of
from pytest_garl.verdicts.verdict import Limits
from tests.execution.flying import Good, job_of, scenario
from tests.execution.misbehaving import LeavesTheLedgerLocked, kept
from tests.support import tiny_simulator

FLIGHT = FlightId(search="search", map="lawn")


def with_control_characters(*args: Any, **more: Any) -> Flight:
    """End as flights do whose landing system raises an error with a text of its own."""
    flight = tiny_simulator.fly(*args, **more)
    crash = crash_of(ValueError("::error:: \x1b[2J"), "step")
    return dataclasses.replace(flight, outcome="crashed", crash=crash)


@pytest.mark.parametrize("simulator", [tiny_simulator.fly, with_control_characters])
def test_another_process_gives_the_same_result_to_the_byte(tmp_path: Path, simulator: Any) -> None:
    job = dataclasses.replace(job_of(Good, tmp_path), simulator=reference_to(simulator))
    here, sha256, wall_s = fly_job(job, scenario(0.2), FLIGHT, None)
    record = load(job.record(FLIGHT))
    with JudgeProcess() as judge:
        there = judge.judge(job, scenario(0.2), FLIGHT, FlownJob(wall_s=9.0))
        assert (there[0].dumps(), *there[1:]) == (here.dumps(), sha256, wall_s)
        limits = Limits(distance_m=5.0)
        assert judge.judge_flight(record, limits) == judged(record, limits)
        refused = judge.judge(job, scenario(), FLIGHT, FlownJob(wall_s=9.0, refusal="a NaN"))
        assert (refused[0].signature, *refused[1:]) == ("V:nonsense:NotFinite", "", 9.0)


def test_record_that_cannot_be_judged_is_an_error(tmp_path: Path) -> None:
    job = job_of(Good, tmp_path)
    flown = fly_and_save(job, scenario(), FLIGHT, None)
    flight = load(job.record(FLIGHT))
    job.record(FLIGHT).write_bytes(b"no record")
    with JudgeProcess() as judge:
        with pytest.raises(GarlError, match=r"cannot be judged: GarlError: .* not a saved flight"):
            judge.judge(job, scenario(), FLIGHT, flown)
        flight.uav.position_m[-1, 2] = np.nan
        with pytest.raises(NotFiniteError, match=r"a NaN or an infinity in 0\.position_m"):
            judge.judge_flight(flight, Limits())


class InterruptedByTimeError(Exception):
    """What a signal raises, as pytest-timeout's does."""


def test_an_interrupted_question_is_not_answered_later(tmp_path: Path) -> None:
    def interrupt(number: int, frame: object) -> None:
        raise InterruptedByTimeError

    job = dataclasses.replace(job_of(Good, tmp_path), simulator=reference_to(tiny_simulator.fly))
    off, near = (dataclasses.replace(FLIGHT, search=name) for name in ("off", "near"))
    flown = {off: fly_and_save(job, scenario(0.2), off, None)}
    flown[near] = fly_and_save(job, scenario(), near, None)
    before = signal.signal(signal.SIGALRM, interrupt)
    others = descendants_of(os.getpid())
    try:
        with JudgeProcess() as judge:
            (process,) = descendants_of(os.getpid()) - others
            os.kill(process, signal.SIGSTOP)
            signal.setitimer(signal.ITIMER_REAL, 0.3)
            with pytest.raises(InterruptedByTimeError):
                judge.judge(job, scenario(0.2), off, flown[off])
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGCONT)
            result, *_ = judge.judge(job, scenario(), near, flown[near])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert result.signature == ""


def test_a_judge_that_was_killed_is_an_error_in_one_sentence(tmp_path: Path) -> None:
    job = job_of(Good, tmp_path)
    flown = fly_and_save(job, scenario(), FLIGHT, None)
    others = descendants_of(os.getpid())
    with JudgeProcess() as judge:
        (process,) = descendants_of(os.getpid()) - others
        os.kill(process, signal.SIGKILL)
        while alive(process):
            time.sleep(0.01)
        with pytest.raises(PoolError, match="the process that judges flights "):
            judge.judge(job, scenario(), FLIGHT, flown)
        # Another one judges the next flight.
        assert judge.judge(job, scenario(), FLIGHT, flown)[0].outcome == "landed"


def test_lock_that_a_flight_leaves_ends_no_run_without_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ledger = Ledger.create(tmp_path / "ledger.sqlite", {})
    pool = local_pool(ledger.queue, workers=0)
    try:
        job = job_of(LeavesTheLedgerLocked, tmp_path / "flights")
        (done,) = fly_all(ledger, pool, job, [scenario()])
    finally:
        pool.close()
        ledger.close()
    assert done.result.outcome == "landed"
    process = kept.pop()
    assert process.wait() < 0
    process.stdout.close()


def test_pool_of_workers_judges_as_this_process_does(tmp_path: Path) -> None:
    job = job_of(Good, tmp_path / "flights")
    here = fly_job(job, scenario(0.2), FLIGHT, None)[0]
    with temporary_pool(1) as (ledger, pool):
        (done,) = fly_all(ledger, pool, job, [scenario(0.2)])
    assert done.result.dumps() == here.dumps()
