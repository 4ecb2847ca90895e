"""A small baseline, its job and a ledger of it, which several tests share."""

from __future__ import annotations

from pathlib import Path

from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import BUILT_IN, Reference
from pytest_garl.gate.baseline_file import (
    Baseline,
    BaselineFlight,
    BaselineSet,
)
from pytest_garl.gate.pairs import FlightSummary
from pytest_garl.gate.record import BaselineSpec
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.verdicts.verdict import Limits
from tests.support.results import flight_result

LAWN, COURT = load_map("lawn"), load_map("court")
LANDED = FlightSummary(
    outcome="landed", signature="", distance_m=0.1, time_s=30.0, sha256="ab" * 32
)
DOG = FlightSummary(outcome="collision", signature="IV:dog:descent:seen", paper_violation=True)


def spec(count: int, domain: str = "paper", seed: int = 0) -> BaselineSpec:
    return BaselineSpec(count=count, seed=seed, domain=domain_named(domain))


def baseline_set(
    count: int = 3, summary: FlightSummary = LANDED, domain: str = "paper"
) -> BaselineSet:
    scenarios = spec(count, domain).scenarios(LAWN)
    return BaselineSet(
        system="stack.landing:Lander",
        map="lawn",
        map_sha256=LAWN.sha256,
        simulator="pytest_garl.simulation.fly:fly",
        npcs="waypoint",
        npcs_sha256="",
        limits=Limits(),
        flights=tuple(BaselineFlight(scenario=each, summary=summary) for each in scenarios),
    )


def baseline(*sets: BaselineSet) -> Baseline:
    versions = (("pytest-garl", "0.1.0"), ("numpy", "2.0.0"))
    return Baseline(cpu="x86_64-avx2", versions=versions, sets=sets or (baseline_set(),))


def job(simulator: Reference = BUILT_IN) -> FlightJob:
    return FlightJob.for_system(
        Reference(module="stack.landing", file="", qualname="Lander"),
        LAWN,
        policy_spec("waypoint"),
        simulator=simulator,
        path=(),
        flights=Path("flights"),
    )


def write_ledger(path: Path, of: FlightJob, method: str = "") -> None:
    ledger = Ledger.create(path, {"method": method} if method else {})
    ledger.add_search("a", "stack.landing:Lander", "lawn", 2, of.dumps())
    texts = [dump_scenario(each) for each in spec(2).scenarios(LAWN)]
    ledger.add_slots("a", 0, dict(enumerate(texts)))
    claim = ledger.queue.claim()
    assert claim is not None
    ledger.queue.record(claim, flight_result(), "ab" * 32, 0.1)
    ledger.close()
