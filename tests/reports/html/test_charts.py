from __future__ import annotations

from pathlib import Path

from pytest_garl.cases.corpus import Corpus
from pytest_garl.reports.html.charts import (
    kinds_over_flights,
    outcome_bar,
    violations_over_flights,
)
from pytest_garl.reports.html.naming import page_name
from pytest_garl.reports.run_reading import read_run
from pytest_garl.reports.run_record import SearchRecord
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.results import flight_result

RESULTS = [
    flight_result(completed=True),
    flight_result("IV:dog:descent:seen"),
    flight_result(completed=True),
    flight_result("IV:dog:descent:seen"),
    flight_result("II:lost:search", outcome="gave_up", violation_type="II"),
    flight_result(outcome="gave_up", excuse="undetectable"),
    flight_result(outcome="inconclusive"),
]


def record(folder: Path) -> SearchRecord:
    path = write_ledger(folder, [Flown(result=each) for each in RESULTS])
    (found,) = read_run(path, Corpus(folder)).searches
    return found


def test_a_bar_holds_each_flight_once(tmp_path: Path) -> None:
    bar = outcome_bar(record(tmp_path))
    counts = {each.kind: each.count for each in bar}
    assert counts == {"landed": 2, "idle": 1, "II": 1, "IV": 2, "inconclusive": 1}
    assert abs(sum(each.width for each in bar) - 100) < 0.01
    assert bar[0].text == "landed as it should: 2 (29 %)"


def test_curves_rise_where_a_flight_finds_something(tmp_path: Path) -> None:
    search = record(tmp_path)
    kinds, violations = kinds_over_flights([search]), violations_over_flights([search])
    assert kinds is not None
    assert violations is not None
    assert (kinds.curves[0].last, violations.curves[0].last) == (2, 3)
    assert kinds.curves[0].points.startswith("0.00,100.00 28.57,100.00 28.57,50.00")
    assert kinds.ticks == (0, 1, 2)
    assert kinds_over_flights([]) is None


def test_pages_of_two_kinds_have_two_names() -> None:
    long = "own:" + "x" * 300
    names = {page_name("m:S", "lawn", "S on lawn", f"{long}{index}") for index in range(3)}
    assert len(names) == 3
    assert max(map(len, names)) < 80


def test_pages_of_one_kind_in_two_searches_have_two_names() -> None:
    searches = ("S on lawn", "S on lawn (domain calm)", "S on lawn (domain field)")
    assert len({page_name("m:S", "lawn", search, "II:lost") for search in searches}) == 3
