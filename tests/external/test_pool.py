"""Programs in a pool of workers: the same bytes, and nothing that they do ends the run."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import pytest

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.reference import BUILT_IN
from pytest_garl.npcs.policy_catalogue import policy_spec
from tests.execution.flying import LAWN, job_of, scenario
from tests.external.misbehaving import (
    FINDINGS,
    HARMLESS,
    PROGRAMS,
    SLOW_FINDINGS,
    left_running,
)

CALM = scenario().without(*(name for name, _ in LAWN.present_objects))


@pytest.fixture
def pool() -> Iterator[tuple[Ledger, Pool]]:
    with temporary_pool(1) as both:
        yield both


def flown(
    both: tuple[Ledger, Pool], name: str, folder: Path, *, timeout_s: float = 10.0, count: int = 1
) -> list[CompletedFlight]:
    job = dataclasses.replace(
        job_of(PROGRAMS[name], folder / "flights", timeout_s),
        simulator=BUILT_IN,
        npcs=policy_spec("stationary"),
    )
    scenarios = [CALM.replace({"heading.start_deg": 10.0 * index}) for index in range(count)]
    return [*fly_all(*both, job, scenarios)]


def test_one_and_two_workers_fly_the_same_bytes(tmp_path: Path) -> None:
    hashes = []
    for workers in (1, 2):
        with temporary_pool(workers) as both:
            done = flown(both, "answers_late", tmp_path / str(workers), count=3)
        assert {each.result.outcome for each in done} == {"landed"}
        hashes.append([each.sha256 for each in done])
    assert hashes[0] == hashes[1]
    assert len({*hashes[0]}) == 3


def test_a_program_that_hangs_is_ended_and_its_report_says_what_it_was_asked(
    pool: tuple[Ledger, Pool], tmp_path: Path
) -> None:
    (done,) = flown(pool, "hangs", tmp_path, timeout_s=0.8)
    assert done.result.crash is not None
    assert (done.result.crash.kind, done.result.crash.error) == ("hung", "Timeout")
    assert "waiting for hangs to answer step, frame 10" in done.result.crash.traceback
    assert left_running() == []


@pytest.mark.long
def test_nothing_that_programs_do_ends_the_run(pool: tuple[Ledger, Pool], tmp_path: Path) -> None:
    """Each is a finding, or flies the same bytes as a program that does nothing."""
    found, hashes = {}, set()
    for name in (*HARMLESS, *FINDINGS, *SLOW_FINDINGS):
        timeout_s = 1.0 if name in SLOW_FINDINGS else 10.0
        (done,) = flown(pool, name, tmp_path, timeout_s=timeout_s)
        assert left_running() == []
        if name in HARMLESS:
            assert done.result.outcome == "landed", name
            hashes.add(done.sha256)
        else:
            found[name] = done.signature
    assert found == {**FINDINGS, **SLOW_FINDINGS}
    assert len(hashes) == 1
