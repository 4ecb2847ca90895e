"""The pages of a run, written when pytest has reported its findings: ``--garl-report=DIR``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pytest_garl.errors import GarlError
from pytest_garl.messages import printable
from pytest_garl.plugin.items.suggested_commands import shown_path
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal_text import counted, width_of, wrapped

if TYPE_CHECKING:
    from pytest_garl.reports.html.report import WrittenReport
    from pytest_garl.reports.run_record import RunRecord


def write_pages(reporter: Any, run: Run, record: RunRecord) -> WrittenReport | None:
    """Write the report of the run, and say where it is, or in one line why there is none."""
    options = run.options
    if options.report is None or not options.searches_or_repeats:
        return None
    from pytest_garl.reports.html.report import write_html_report

    width = width_of(reporter.config)
    reporter.section("garl: report", sep="=")
    try:
        written = write_html_report(record, options.report, workers=options.workers or None)
    except GarlError as error:
        reporter.write_line(wrapped(f"garl: {printable(str(error))}", width), red=True)
        return None
    pages = f"{counted(written.pages, 'page')}, {counted(written.films, 'film')}"
    where = shown_path(written.index.absolute(), reporter.config)
    for line in (f"{where}: {pages}", *written.notes):
        reporter.write_line(wrapped(printable(line), width, others="  "))
    return written
