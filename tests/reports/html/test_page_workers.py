from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.errors import GarlError
from pytest_garl.reports.html import page_workers
from pytest_garl.reports.html.flight_task import FlightTask, shown_flight
from pytest_garl.reports.html.kind_page import plan_kinds
from pytest_garl.reports.html.page_workers import shown_flights
from pytest_garl.reports.run_reading import read_run
from tests.reports.html.test_report import lost
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.videos import Video


@pytest.fixture
def tasks(tmp_path: Path, video: Video) -> list[FlightTask]:
    flown = [
        Flown(result=lost(signature=f"II:lost:{index}"), flight=video.flight) for index in range(5)
    ]
    path = write_ledger(tmp_path, flown)
    run = read_run(path, Corpus(tmp_path / "cases"))
    return [plan.task for plan in plan_kinds(run, 0)]


def test_processes_show_what_this_one_does_in_order(tasks: list[FlightTask]) -> None:
    done: list[int] = []
    assert shown_flights(tasks, 2, done.append) == [shown_flight(task) for task in tasks]
    assert done == [1, 2, 3, 4, 5]


def test_a_process_that_ends_is_one_message(tasks: list[FlightTask]) -> None:
    nothing: Any = None
    broken = [dataclasses.replace(task, result=nothing) for task in tasks]
    with pytest.raises(GarlError, match=r"lawn-g00-s0\d: the process that drew it ended"):
        shown_flights(broken, 2)


def test_few_flights_start_no_process(
    tasks: list[FlightTask], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_workers, "in_processes", None)
    assert len(shown_flights(tasks[:2], 2)) == 2
