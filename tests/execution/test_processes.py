from __future__ import annotations

import dataclasses
import os

import pytest

from pytest_garl.execution.processes import Parent, WorkerReport, create_report_file, read_report
from pytest_garl.execution.supervisor import FlightMonitor

FULL = WorkerReport(
    status=-9,
    hung="one call took longer than 2 s of wall time",
    stacks="in step",
    stderr="no fuel",
    failure=("ValueError", "no array", "Traceback"),
    cannot_go_on="the ledger is gone",
)


@pytest.mark.parametrize(
    "report",
    [
        FULL,
        WorkerReport(),
        *(WorkerReport(**{name: value}) for name, value in dataclasses.asdict(FULL).items()),
    ],
)
def test_parent_reads_what_its_child_reports(report: WorkerReport) -> None:
    file = create_report_file()
    parent = Parent(pid=os.getppid(), file=file)
    assert read_report(file) is None
    parent.report(FULL)
    parent.report(report)
    assert read_report(file) == report
    os.close(file)


def test_supervisor_reads_a_failure_whose_texts_do_not_fit_into_the_memory() -> None:
    """Each of these letters takes six bytes as JSON."""
    text = "ж" * 20_000
    monitor = FlightMonitor()
    monitor.report(WorkerReport(failure=("ValueError", "no array", f"{text}the end")))
    report = monitor.reported()
    assert report is not None
    assert report.failure is not None
    kind, message, shortened = report.failure
    assert (kind, message) == ("ValueError", "no array")
    assert shortened.endswith("жthe end")
    assert len(shortened) > 4_000


def test_request_that_was_not_answered_is_no_report() -> None:
    assert WorkerReport.loads(b'{"wall_s": 1.0, "refusal": ""}') is None
