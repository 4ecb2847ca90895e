"""What the gate and baselines fly is decided by what ships, not by what a search learned."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from pytest_garl.execution.checkout import Checkout
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.reference import reference_to
from pytest_garl.gate.record import BaselineSpec, baseline_from_ledger, fly_baseline
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from tests.search.learned_search import DOMAIN, MAP, Run, sinks

GRADED = policy_spec("graded")


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    """Yield a search that has learned when NPCs begin and when events strike."""
    run = Run(tmp_path_factory.mktemp("learned"))
    run.fly()
    yield run
    run.end()


def hashes(scenarios: Sequence[Scenario]) -> list[str]:
    """Return the hashes of flights of which what ships decides."""
    return [sinks(each, None, GRADED, map=MAP).sha256 for each in scenarios]


def test_flights_beside_a_search_are_decided_by_the_rule(learned: Run) -> None:
    flights = learned.ledger.queries.flights("s")
    scenarios = [parse_scenario(each.scenario) for each in flights]
    job = parse_job(learned.ledger.job("s") or "")
    pool = local_pool(learned.ledger.queue, workers=0)
    try:
        beside = [each.sha256 for each in fly_all(learned.ledger, pool, job, scenarios)]
    finally:
        pool.close()
    assert beside == hashes(scenarios)
    assert beside != [each.sha256 for each in flights], "the search had learned weights"


def test_a_baseline_of_a_search_flies_again_by_what_ships(learned: Run) -> None:
    (found,) = baseline_from_ledger(learned.ledger.path).sets
    scenarios = [each.scenario for each in found.flights]
    assert not any(each.decided_events for each in scenarios)
    assert policy_spec(found.npcs) == GRADED, "the gate flies the policy of this name"
    assert hashes(scenarios) == [each.summary.sha256 for each in found.flights]


def test_scenarios_that_are_drawn_for_a_baseline_are_decided_by_the_rule(tmp_path: Path) -> None:
    (tmp_path / "events.toml").write_text(DOMAIN)
    spec = BaselineSpec(
        maps=("lawn",),
        count=8,
        domain=domain_named("events.toml", tmp_path),
        npcs="graded",
        simulator=reference_to(sinks),
    )
    checkout = Checkout(folder=Path(__file__).parents[2])
    systems = ["tests.execution.flying:Good"]
    (found,) = fly_baseline(spec, checkout, systems, 1, lambda flights, *_: flights).sets
    scenarios = [each.scenario for each in found.flights]
    assert any(each.decided_events for each in scenarios)
    assert hashes(scenarios) == [each.summary.sha256 for each in found.flights]
