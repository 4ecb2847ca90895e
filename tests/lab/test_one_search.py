"""One search of the lab: a row per flight, an end at the first find, nothing flown twice."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from lab import one_search
from lab.arms import arm_named
from lab.one_search import COLUMNS, Flown, SearchTask, flights_of, plan_of, rows_of, run
from lab.stand_in import stand_in
from lab.stand_in_way import ORDINARY
from lab.table import ResultTable
from pytest_garl import Airframe
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import PolicySpec

TASK = SearchTask(system="here:Stack", map="court", arm="garl", seed=301, flights=50)
MAP = load_map("court")


def arithmetic(scenario: Scenario) -> FlightResult:
    return stand_in(scenario, MAP, ORDINARY)


def fly_all(npcs: PolicySpec, scenarios: Sequence[Scenario]) -> Iterator[Flown]:
    return (Flown(result=arithmetic(each)) for each in scenarios)


def test_a_search_has_a_row_for_each_flight_and_children_name_their_parents() -> None:
    rows = list(rows_of(TASK, fly_all))
    assert [row["flight"] for row in rows] == [*range(1, 51)]
    assert {row["how"] for row in rows} == {"control", "stratified", "bred"}
    bred = [row for row in rows if row["how"] == "bred"]
    assert len(bred) >= (50 - 8) / 2
    assert all(len(row["parents"].split()) >= 2 for row in bred)
    assert [row["is_last"] for row in rows].index(1) == 49


def test_a_search_ends_at_the_first_flight_that_matches() -> None:
    whole = [row["signature"] for row in rows_of(TASK, fly_all)]
    wanted = next(each for each in whole if each.startswith("IV"))
    rows = list(rows_of(dataclasses.replace(TASK, until="^IV"), fly_all))
    assert [row["signature"] for row in rows] == whole[: whole.index(wanted) + 1]
    assert rows[-1]["is_last"] == 1


def test_an_arm_without_children_has_none() -> None:
    rows = rows_of(dataclasses.replace(TASK, arm="exploring+"), fly_all)
    assert "bred" not in {row["how"] for row in rows}


def test_a_search_goes_on_where_its_table_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown: list[Scenario] = []

    def fly_one(system: str, npcs: PolicySpec, scenario: Scenario) -> Flown:
        flown.append(scenario)
        return Flown(result=arithmetic(scenario))

    monkeypatch.setattr(one_search, "fly_one", fly_one)
    whole = ResultTable(file=tmp_path / "whole.csv", columns=COLUMNS, key=COLUMNS[:5])
    with ThreadPoolExecutor(1) as pool:
        go = functools.partial(run, TASK, pool=pool)
        go(whole)
        assert len(flown) == 50
        cut = ResultTable(file=tmp_path / "cut.csv", columns=COLUMNS, key=COLUMNS[:5])
        cut.file.write_text("".join(whole.file.read_text().splitlines(keepends=True)[:18]))
        go(cut)
        assert cut.file.read_bytes() == whole.file.read_bytes()
        flown.clear()
        go(whole)
    assert not flown


class Learner:
    """A director that says from how many generations it has learned."""

    def __init__(self, *about: object) -> None:
        self.generations = 0

    def learn(self, flights: object) -> None:
        self.generations += 1

    @property
    def text(self) -> str:
        return f"time-to-go {self.generations} 0"


@pytest.mark.parametrize(("arm", "learned"), [("garl", ["0", "1", "1", "2", "3"]), ("shipped", [])])
def test_a_director_learns_one_generation_behind(
    arm: str, learned: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(one_search, "SearchDirectors", Learner)
    directors = list[str]()

    def fly_all(npcs: PolicySpec, scenarios: Sequence[Scenario]) -> Iterator[Flown]:
        directors.append(str(dict(npcs.arguments).get("director", "time-to-go 0 0")))
        return (Flown(result=arithmetic(each)) for each in scenarios)

    flights = list(flights_of(arm_named(arm), plan_of("court", 301, 40), 40, fly_all, Airframe()))
    assert [flight.number for flight in flights] == [*range(1, 41)]
    assert [each.split()[1] for each in directors] == (learned or ["0"] * 5)
