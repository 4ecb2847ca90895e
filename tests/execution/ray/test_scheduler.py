from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import PoolError
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.execution.ray.actor import ActorWorkspace, FlightOutput, versions
from pytest_garl.execution.ray.scheduler import RayScheduler, different_versions
from pytest_garl.execution.worker_failure import WorkerExit
from pytest_garl.scenarios.files import dump_scenario
from tests.execution.flying import Good, job_of, scenario
from tests.execution.ledgers import result_of, sha256_of
from tests.support.results import flight_result

LANDED = FlightOutput(result=flight_result(), sha256="hash", wall_s=1.5, record=b"record")
KILLED = WorkerExit(status=-9)


def flight_of(index: int) -> FlightId:
    return FlightId(search="search", map="lawn", slot=Slot(generation=0, index=index))


class RayError(Exception):
    """Ray's base; the others are below it, as Ray's are."""


class RayTaskError(RayError):
    def __init__(self, cause: Exception) -> None:
        super().__init__(str(cause))
        self.cause = cause


class WorkerLostError(RayError):
    pass


class FakeRay:
    """Ray as far as the scheduler uses it: a call is answered at once, or when it is waited for.

    ``fly`` and ``node_and_versions`` give the answers of actors; ``get`` raises an exception.
    """

    exceptions = type("exceptions", (), {"RayError": RayError, "RayTaskError": RayTaskError})

    def __init__(
        self,
        fly: Callable[[Claim], object] = lambda claim: LANDED,
        node_and_versions: Callable[[], object] = lambda: ("node", versions()),
    ) -> None:
        self._answers: dict[str, Callable[..., object]] = {
            "fly": fly,
            "node_and_versions": node_and_versions,
            "close": lambda: None,
        }
        self._refs: dict[int, object] = {}
        self.started = self.closed = 0
        self.most = 0

    def remote(self, *, num_cpus: int) -> Callable[[type], Any]:
        assert num_cpus == 1
        return lambda actor: type("ActorClass", (), {"remote": staticmethod(self._start)})

    def _start(self, workspace: ActorWorkspace) -> Any:
        self.started += 1
        return type("Actor", (), {name: self._method(name) for name in self._answers})

    def _method(self, name: str) -> Any:
        def call(*arguments: Any) -> int:
            self.closed += name == "close"
            ref = len(self._refs)
            self._refs[ref] = self._answers[name](*arguments)
            return ref

        return type("Method", (), {"remote": staticmethod(call)})

    def wait(self, refs: Sequence[int], *, timeout: float) -> tuple[list[int], list[int]]:
        self.most = max(self.most, len(refs))
        return list(refs[:1]), list(refs[1:])

    def get(self, ref: int | list[int], timeout: float | None = None) -> object:
        if isinstance(ref, list):
            return [self.get(each) for each in ref]
        answer = self._refs[ref]
        if isinstance(answer, Exception):
            raise answer
        return answer


@pytest.fixture
def ledger(tmp_path: Path) -> Ledger:
    ledger = Ledger.create(tmp_path / "ledger.sqlite", {})
    job = job_of(Good, tmp_path / "flights")
    ledger.add_search("search", "flying:Good", "lawn", 3, job.dumps())
    ledger.add_slots("search", 0, {index: dump_scenario(scenario()) for index in range(3)})
    return ledger


def fly(ray: FakeRay, ledger: Ledger, size: int = 2) -> RayScheduler:
    scheduler = RayScheduler(ray, ledger.queue, ActorWorkspace(), size)
    for _ in range(100):
        if not ledger.queries.unflown("search", 0):
            break
        scheduler.turn()
    return scheduler


def test_scheduler_flies_all_slots_and_writes_records_into_the_jobs_folder(
    ledger: Ledger, tmp_path: Path
) -> None:
    ray = FakeRay()
    fly(ray, ledger).close()
    assert ledger.generation("search", 0) == [(dump_scenario(scenario()), LANDED.result)] * 3
    assert sha256_of(ledger, flight_of(2)) == "hash"
    assert ledger.queries.meters()["flying_s"] == 4.5
    files = {path.name: path.read_bytes() for path in (tmp_path / "flights").iterdir()}
    assert files == {f"search-lawn-g00-s0{index}.npz": b"record" for index in range(3)}
    assert (ray.started, ray.most, ray.closed) == (2, 2, 2)


def test_scheduler_starts_no_more_actors_than_slots(ledger: Ledger) -> None:
    ray = FakeRay()
    fly(ray, ledger, size=500)
    assert ray.started == 3


def test_slot_of_a_lost_actor_is_flown_by_another(ledger: Ledger) -> None:
    losses = itertools.chain([WorkerLostError("killed")] * 2, itertools.repeat(LANDED))
    ray = FakeRay(fly=lambda claim: next(losses))
    fly(ray, ledger)
    assert [result for _, result in ledger.generation("search", 0)] == [LANDED.result] * 3
    assert "retried" not in ledger.queries.meters()
    assert ray.started == 4


def test_slot_that_loses_actor_after_actor_ends_the_run(ledger: Ledger) -> None:
    ray = FakeRay(
        fly=lambda claim: (
            WorkerLostError("out of memory") if claim.flight.slot.index == 1 else LANDED
        )
    )
    with pytest.raises(PoolError, match="the same slot 4 times: out of memory"):
        fly(ray, ledger)
    assert ledger.queries.unflown("search", 0) == 1


def test_actors_that_cannot_start_end_the_run(ledger: Ledger) -> None:
    ray = FakeRay(node_and_versions=lambda: WorkerLostError("No module named 'pytest_garl'"))
    with pytest.raises(PoolError, match=r"end before they fly: No module named 'pytest_garl'\n"):
        fly(ray, ledger, size=1)
    assert ray.started == 4


def test_node_with_other_versions_ends_the_run_before_a_flight(ledger: Ledger) -> None:
    ray = FakeRay(node_and_versions=lambda: ("far-1", versions() | {"numpy": "1.0"}))
    with pytest.raises(PoolError, match=r"node far-1 would not fly the same: it has numpy 1\.0 \("):
        fly(ray, ledger)
    assert ledger.queries.unflown("search", 0) == 3


def test_missing_package_counts_as_another_version() -> None:
    assert different_versions({"a": "1", "b": "2"}, {"a": "1"}) == "b missing (here 2)"
    assert different_versions({"a": "1"}, {"a": "1", "c": "3"}) == ""


def test_worker_exit_is_handled_as_in_the_local_pool(ledger: Ledger) -> None:
    claims: list[Claim] = []

    def die(claim: Claim) -> object:
        claims.append(claim)
        return KILLED if claim.flight.slot.index == 0 else LANDED

    fly(FakeRay(fly=die), ledger)
    result = result_of(ledger, flight_of(0))
    assert result is not None
    assert result.signature == "V:died:signal-9"
    assert [claim.earlier_exits for claim in claims if claim.flight.slot.index == 0] == [
        "",
        "killed",
    ]
    assert ledger.queries.meters()["retried"] == 1


def test_slot_to_fly_alone_is_flown_even_if_its_actor_is_lost(ledger: Ledger) -> None:
    answers = iter([LANDED, LANDED, KILLED, WorkerLostError("killed"), LANDED])
    fly(FakeRay(fly=lambda claim: next(answers)), ledger, size=1)
    assert ledger.queries.unflown("search", 0) == 0


def test_error_on_a_node_is_raised_without_rays_wrapper(ledger: Ledger) -> None:
    ray = FakeRay(fly=lambda claim: RayTaskError(PoolError("the simulator failed")))
    with pytest.raises(PoolError, match=r"^on a node of Ray: the simulator failed$"):
        fly(ray, ledger)
