"""The count of what evolved and learned in a ledger, against searches of the stand-in."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from lab.replay import SearchCount, count, report
from lab.stand_in import stand_in
from lab.stand_in_way import ORDINARY
from pytest_garl.errors import LedgerError
from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.flight_id import slots
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import Reference
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.reports.search_origins import MoverRecord
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.breeder import Breeder
from pytest_garl.search.method import SearchPlan
from pytest_garl.search.method_catalogue import make_method

MAP = load_map("court")
BUDGET, SIZE = 24, 6


def searched(folder: Path, method: str) -> Path:
    """Fly a search of the stand-in into a ledger; return its file."""
    path = folder / "ledger.sqlite"
    facts = {"seed": 3, "method": method, "population": SIZE, "domain": "field", "budget": BUDGET}
    ledger = Ledger.create(path, facts)
    job = FlightJob.for_system(
        Reference(module="my_stack", file="", qualname="Stack"),
        MAP,
        policy_spec("graded"),
        flights=folder,
        path=(),
    )
    ledger.add_search("s", "my_stack:Stack", "court", BUDGET, job.dumps())
    ledger.facts.note_search("s", SearchKey(system="my_stack:Stack", map="court", domain="field"))
    plan = SearchPlan(
        map=MAP,
        genome=genome_of(domain_named("field"), MAP),
        seed=3,
        flights=BUDGET,
        population=SIZE,
    )
    wanted: dict[int, list[int]] = {}
    for slot in slots(BUDGET, SIZE):
        wanted.setdefault(slot.generation, []).append(slot.index)
    breeder = Breeder(ledger, "s", make_method(method, plan), wanted)
    while True:
        breeder.advance()
        claim = ledger.queue.claim()
        if claim is None:
            ledger.close()
            return path
        result = stand_in(parse_scenario(claim.scenario), MAP, ORDINARY)
        ledger.queue.record(claim, result, "", 0.0)


def changed(path: Path, key: str, value: object) -> None:
    ledger = Ledger(path)
    ledger.database.execute("UPDATE run SET value = ? WHERE key = ?", (json.dumps(value), key))
    ledger.close()


def test_children_of_a_search_are_counted_checked_and_bred_again(tmp_path: Path) -> None:
    path = searched(tmp_path, "garl")
    before = path.read_bytes()
    (found,) = count(path)
    assert (found.name, found.control) == ("Stack on court", SIZE)
    assert found.stratified + found.children == BUDGET - SIZE
    assert found.true_children == found.children >= found.after_control / 2
    assert found.movers.interfering > 0 == found.by_own
    assert found.bred_again == ""
    assert path.read_bytes() == before


def test_a_child_of_flights_that_it_has_nothing_of_is_none(tmp_path: Path) -> None:
    path = searched(tmp_path, "garl")
    ledger = Ledger(path)
    origins = [dataclasses.asdict(each) for each in ledger.facts.origins("s", 2)]
    ledger.close()
    child = next(each for each in origins if each["how"] == "bred")
    child["parents"] = ["court-g03-s00", "court-g03-s01"]
    changed(path, "origins of s 2", origins)
    (found,) = count(path)
    assert found.true_children == found.children - 1
    text, holds = report([found], has_pymoo=True)
    assert not holds
    assert "Stack on court has children that are none" in text


def test_a_ledger_with_other_scenarios_is_not_bred_again(tmp_path: Path) -> None:
    path = searched(tmp_path, "garl")
    changed(path, "seed", 4)
    (found,) = count(path)
    assert "bred in another way" in found.bred_again


def test_weights_that_a_search_learned_are_told(tmp_path: Path) -> None:
    path = searched(tmp_path, "garl")
    ledger = Ledger(path)
    ledger.facts.note_director("s", 1, "time-to-go 0 0")
    ledger.close()
    (found,) = count(path)
    assert 0 < found.by_own < found.movers.directed


def test_a_method_without_children_does_not_hold(tmp_path: Path) -> None:
    (found,) = count(searched(tmp_path, "random"))
    assert (found.control, found.children, found.bred_again) == (0, 0, "")
    text, holds = report([found], has_pymoo=False)
    assert not holds
    assert "less than half of the flights after the control are children" in text
    assert "pymoo was not imported" in text


@pytest.mark.parametrize(("directed", "expected"), [(5, True), (4, False)])
def test_the_director_must_decide_in_half_of_the_flights(directed: int, expected: bool) -> None:
    movers = MoverRecord(director=5, rule=0, gene=0, policy=0, interfering=10, directed=directed)
    found = SearchCount(
        name="it",
        control=8,
        stratified=6,
        children=6,
        true_children=6,
        movers=movers,
        by_own=2,
        bred_again="",
    )
    text, holds = report([found], has_pymoo=True)
    assert holds is expected
    assert f"in this search in 2, with those that ship in {directed - 2};" in text


def test_a_missing_ledger_is_named(tmp_path: Path) -> None:
    with pytest.raises(LedgerError, match="there is no ledger at"):
        count(tmp_path / "ledger.sqlite")
