"""A search whose directors learn from an analytic landing, flown and killed slot by slot."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.airframe import Airframe
from pytest_garl.execution.fly_and_judge import fly_job
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.execution.reference import reference_to
from pytest_garl.flight.flight import Flight, Track
from pytest_garl.flight.flight_file import hash_of
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.groups import EVENTS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.breeder import Breeder
from pytest_garl.search.method import SearchPlan
from pytest_garl.search.methods.garl import Garl
from pytest_garl.search.teaching import Lessons, Teacher
from pytest_garl.simulation.events import Beginning
from pytest_garl.simulation.landing_moments import LandingMoments
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, PolicySpec
from pytest_garl.simulation.strikes import Strikes
from tests.execution.flying import Good, job_of

MAP = load_map("lawn")
SIZE, GENERATIONS = 8, 4
TOP_M, SINKS_MPS, HURTS_ABOVE_M = 10.0, 0.8, 5.0
DOMAIN = """
npc_behaviour = "chasing"

[told]
surveyed = [1, 1]

[jump]
after = [0, 6]
from_s = [0, 8]
distance_m = [1, 3]

[outage]
after = [0, 6]
from_s = [0, 8]
lasts_s = [1, 5]
"""


def sinks(scenario: Scenario, system: Any, npcs: PolicySpec, *, map: Any, **_: Any) -> Flight:
    """Return a descent; an event that strikes high above the marker moves the touchdown."""
    marker = Placed(scenario, map).marker_m
    moments = LandingMoments()
    strikes = Strikes(scenario, moments, npcs.event_director())
    count = int(TOP_M / SINKS_MPS / DECISION_STEP_S) + 1
    times = DECISION_STEP_S * np.arange(count, dtype=np.float64)
    heights = TOP_M - SINKS_MPS * times
    for time_s, height_m in zip(times.tolist(), heights.tolist(), strict=True):
        moments.update(time_s, feet_height_m(height_m))
        strikes.decide(time_s, (*marker, height_m), (0.0, 0.0, -SINKS_MPS), marker, None)
    acting = {key.partition(".")[0] for key, _ in scenario.genes} & {*EVENTS}
    struck_s = [Beginning(scenario, each, moments).time_s for each in acting]
    off_m = 1.0 if any(TOP_M - SINKS_MPS * each > HURTS_ABOVE_M for each in struck_s) else 0.1
    places = np.stack([np.full_like(times, marker[0]), np.full_like(times, marker[1]), heights], 1)
    places[-1, 0] += off_m
    flight = Flight(
        outcome="landed",
        final_distance_m=off_m,
        elapsed_s=float(times[-1]),
        marker_position_m=marker,
        uav=Track(
            time_s=times,
            position_m=places,
            attitude=np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1)),
            velocity_mps=np.tile([0.0, 0.0, -SINKS_MPS], (len(times), 1)),
        ),
        objects=(),
        contacts=(),
        separations=(),
        events=(),
        steps=(),
        moments=moments.record,
    )
    return dataclasses.replace(flight, sha256=hash_of(flight))


@dataclass(frozen=True, kw_only=True)
class Searched:
    """What a search left in its ledger: all of it is the same for equal searches."""

    results: str
    weights: tuple[str, ...]
    progress: tuple[Any, ...]
    decided: tuple[Any, ...]


class Run:
    """Processes that fly one search in a folder; a new one goes on where an earlier one ended."""

    def __init__(self, folder: Path) -> None:
        path = folder / "ledger.sqlite"
        self.ledger = Ledger.resume(path, {}) if path.exists() else Ledger.create(path, {})
        job = dataclasses.replace(
            job_of(Good, folder / "flights"),
            simulator=reference_to(sinks),
            npcs=policy_spec("graded"),
        )
        (folder / "events.toml").write_text(DOMAIN)
        genome = genome_of(domain_named("events.toml", folder), MAP)
        plan = SearchPlan(
            map=MAP, genome=genome, seed=2, flights=SIZE * GENERATIONS, population=SIZE
        )
        self.ledger.add_search("s", "m:Good", "lawn", SIZE * GENERATIONS, job.dumps())
        self.teacher = Teacher()
        self._breeder = Breeder(
            self.ledger,
            "s",
            Garl(plan),
            {generation: range(SIZE) for generation in range(GENERATIONS)},
            Lessons(self.teacher, "s", job, Airframe()),
        )

    def claims(self) -> Iterator[Claim]:
        """Yield slots until all are claimed."""
        while True:
            self._breeder.advance()
            claim = self.ledger.queue.claim()
            if claim is None:
                return
            yield claim

    def record(self, claim: Claim) -> None:
        """Fly a slot, and record the result."""
        job, scenario = parse_job(claim.job), parse_scenario(claim.scenario)
        self.ledger.queue.record(claim, *fly_job(job, scenario, claim.flight, None))

    def fly(self) -> None:
        """Fly all slots, one after the other."""
        for claim in self.claims():
            self.record(claim)

    def end(self) -> Searched:
        """End as if killed, with claims that nobody returns; return what is in the ledger."""
        found = self._searched()
        self.teacher.close()
        self.ledger.close()
        return found

    def _searched(self) -> Searched:
        facts, generations = self.ledger.facts, range(GENERATIONS)
        return Searched(
            results=self.ledger.queries.result_hash(),
            weights=tuple(facts.director("s", each) for each in generations),
            progress=tuple(facts.progress("s", each) for each in generations),
            decided=tuple(each.result.decided for each in self.ledger.queries.flights("s")),
        )
