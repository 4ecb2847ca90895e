from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import pytest

from pytest_garl.execution.flight_id import Slot, slots
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.result import FlightResult
from pytest_garl.npcs.director_progress import DirectorProgress, EventProgress, Progress
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.plugin.options import population
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.breeder import Breeder
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.teaching import Lessons
from tests.execution.flying import Good, job_of
from tests.search.searches import every_method, result

MAP = load_map("court")
GENOME = genome_for(MAP)


def searched(path: Path, name: str, budget: int, wanted: tuple[Slot, ...] = ()) -> Ledger:
    """Breed and fly, by a formula, until nothing is left to do."""
    size = population(budget)
    plan = SearchPlan(map=MAP, genome=GENOME, seed=1, flights=budget, population=size)
    generations: dict[int, list[int]] = {}
    for slot in wanted or slots(budget, size):
        generations.setdefault(slot.generation, []).append(slot.index)
    ledger = Ledger.create(path, {})
    ledger.add_search("s", "m:S", "court", budget, "{}")
    breeder = Breeder(ledger, "s", make_method(name, plan), generations)
    while True:
        breeder.advance()
        claim = ledger.queue.claim()
        if claim is None:
            return ledger
        ledger.queue.record(claim, result(parse_scenario(claim.scenario)), "", 0.0)


# Two more fly the scenarios of random search, each with other objects.
@pytest.mark.parametrize(
    "budgets",
    [
        # A search of less than a population, and of one, two or three with some left over.
        pytest.param((*range(1, 11), 15, 16, 17, 24, 30), id="some"),
        pytest.param(range(1, 61), id="all", marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("name", every_method("surrogate-random", "online-rl"))
def test_every_budget_is_flown_exactly(tmp_path: Path, name: str, budgets: Sequence[int]) -> None:
    for budget in budgets:
        ledger = searched(tmp_path / f"{budget}.sqlite", name, budget)
        texts = [
            text
            for generation in range(60)
            for text, flown in ledger.generation("s", generation)
            if flown is not None
        ]
        assert len(texts) == len(set(texts)) == budget
        assert ledger.queries.meters()["flights"] == budget
        ledger.close()


def test_a_learning_method_flies_the_parents_of_selected_slots(tmp_path: Path) -> None:
    wanted = (Slot(generation=2, index=3),)
    ledger = searched(tmp_path / "garl.sqlite", "garl", 40, wanted)
    assert [len(ledger.generation("s", generation)) for generation in range(4)] == [8, 8, 1, 0]
    ledger = searched(tmp_path / "random.sqlite", "random", 40, wanted)
    assert [len(ledger.generation("s", generation)) for generation in range(4)] == [0, 0, 1, 0]


def test_selected_slots_are_bred_like_the_whole_search(tmp_path: Path) -> None:
    whole = searched(tmp_path / "whole.sqlite", "garl", 40)
    part = searched(tmp_path / "part.sqlite", "garl", 40, (Slot(generation=2, index=3),))
    assert part.generation("s", 2)[0] == whole.generation("s", 2)[3]


def test_objectives_of_every_learned_generation_are_noted(tmp_path: Path) -> None:
    import sqlite3

    searched(tmp_path / "ledger.sqlite", "garl-paper", 40).close()
    database = sqlite3.connect(tmp_path / "ledger.sqlite")
    rows = database.execute(
        "SELECT generation, count(objectives) FROM slot GROUP BY generation ORDER BY generation"
    ).fetchall()
    database.close()
    # The last generation has no successor that would learn from it.
    assert rows == [(0, 8), (1, 8), (2, 8), (3, 8), (4, 0)]


def test_a_generation_of_a_method_that_overlaps_is_added_while_the_one_before_is_flown(
    tmp_path: Path,
) -> None:
    # The second generation waits for the first in any case.
    for name, expected in (("garl", [1, 3, 4, 4]), ("garl-paper", [1, 2, 3, 4])):
        plan = SearchPlan(map=MAP, genome=GENOME, seed=1, flights=16, population=4)
        ledger = Ledger.create(tmp_path / f"{name}.sqlite", {})
        ledger.add_search("s", "m:S", "court", 16, "{}")
        wanted = {generation: range(4) for generation in range(4)}
        breeder = Breeder(ledger, "s", make_method(name, plan), wanted)
        counts = []
        for _ in range(4):
            breeder.advance()
            counts.append(sum(bool(ledger.generation("s", number)) for number in range(4)))
            for _ in range(4):
                claim = ledger.queue.claim()
                assert claim is not None
                ledger.queue.record(claim, result(parse_scenario(claim.scenario)), "", 0.0)
        assert counts == expected
        ledger.close()


def test_a_method_that_overlaps_proposes_the_same_if_it_is_told_at_once() -> None:
    plan = SearchPlan(map=MAP, genome=GENOME, seed=1, flights=32, population=8)
    prompt, late = make_method("garl", plan), make_method("garl", plan)
    generations = []
    for _ in range(4):
        scenarios = prompt.ask()
        flown = [FlownScenario(scenario=each, result=result(each)) for each in scenarios]
        prompt.tell(flown)
        generations.append((scenarios, flown))
    for number, (scenarios, _) in enumerate(generations):
        if number == 1:
            late.tell(generations[0][1])
        elif number > 2:
            late.tell(generations[number - 2][1])
        assert late.ask() == scenarios


def test_the_ledger_says_how_each_scenario_was_made(tmp_path: Path) -> None:
    ledger = searched(tmp_path / "garl.sqlite", "garl", 28)
    noted = [ledger.facts.origins("s", generation) for generation in range(5)]
    assert [len(each) for each in noted] == [8, 8, 8, 8, 0]
    assert {each.how for each in noted[0]} == {"control"}
    children = [each for each in noted[2] if each.how == "bred"]
    assert len(children) == 6
    flown = {f"court-g00-s{index:02d}" for index in range(8)}
    assert all(len(each.parents) >= 2 and {*each.parents} <= flown for each in children)
    ledger.close()
    ledger = searched(tmp_path / "random.sqlite", "random", 28)
    assert ledger.facts.origins("s", 0) == []
    ledger.close()


class Counts(Lessons):
    """Lessons whose director tells which generation was learned last."""

    def __init__(self) -> None:
        self.director = ""
        self.learned: list[tuple[int, int]] = []

    def learn(self, generation: int, flown: Sequence[tuple[str, FlightResult | None]]) -> Progress:
        self.learned.append((generation, len(flown)))
        self.director = f"time-to-go {generation} 0"
        npcs = DirectorProgress(
            npcs=generation, learned=0, shipped=0, rule=0, best=0, seen=0, expected=0, met=0
        )
        events = EventProgress(
            flights=generation, learned=0, rule=0, best=0, struck=0, expected=0, violated=0
        )
        return Progress(npcs=npcs, events=events)


def test_the_director_of_a_generation_has_learned_what_its_scenarios_were_bred_from(
    tmp_path: Path,
) -> None:
    plan = SearchPlan(map=MAP, genome=GENOME, seed=1, flights=16, population=4)
    job = dataclasses.replace(job_of(Good, tmp_path), npcs=policy_spec("graded"))
    ledger = Ledger.create(tmp_path / "ledger.sqlite", {})
    ledger.add_search("s", "m:S", "court", 16, job.dumps())
    wanted = {generation: range(4) for generation in range(4)}
    lessons = Counts()
    breeder = Breeder(ledger, "s", make_method("garl", plan), wanted, lessons)
    flown_by: dict[int, set[str]] = {}
    for _ in range(16):
        breeder.advance()
        claim = ledger.queue.claim()
        assert claim is not None
        director = dict(parse_job(claim.job).npcs.arguments).get("director", "")
        flown_by.setdefault(claim.flight.slot.generation, set()).add(str(director))
        ledger.queue.record(claim, result(parse_scenario(claim.scenario)), "", 0.0)
    assert flown_by == {
        0: {""},
        1: {"time-to-go 0 0"},
        2: {"time-to-go 0 0"},
        3: {"time-to-go 1 0"},
    }
    assert lessons.learned == [(0, 4), (1, 4)]
    progress = ledger.facts.progress("s", 1)
    assert progress is not None
    assert progress.npcs.npcs == progress.events.flights == 1
    assert ledger.facts.progress("s", 3) is None
    assert "time-to-go" not in (ledger.job("s") or ""), "the gate flies what ships"
    ledger.close()


def test_a_search_that_was_killed_goes_on_with_the_same_scenarios(tmp_path: Path) -> None:
    whole = searched(tmp_path / "whole.sqlite", "garl", 40)
    plan = SearchPlan(map=MAP, genome=GENOME, seed=1, flights=40, population=8)
    wanted = {generation: range(8) for generation in range(5)}
    part = Ledger.create(tmp_path / "part.sqlite", {})
    part.add_search("s", "m:S", "court", 40, "{}")
    breeder = Breeder(part, "s", make_method("garl", plan), wanted)
    for flight in range(40):
        # The process is killed in the middle of each generation.
        if flight % 8 == 5:
            breeder = Breeder(part, "s", make_method("garl", plan), wanted)
        breeder.advance()
        claim = part.queue.claim()
        assert claim is not None
        part.queue.record(claim, result(parse_scenario(claim.scenario)), "", 0.0)
    for generation in range(5):
        assert part.generation("s", generation) == whole.generation("s", generation)
        assert part.facts.origins("s", generation) == whole.facts.origins("s", generation)
    part.close()
    whole.close()
