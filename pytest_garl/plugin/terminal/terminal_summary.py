"""All that a session writes after pytest's own sections; no part takes another one down."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from pytest_garl.plugin.items.keys import RUN
from pytest_garl.plugin.session.tally import Tally
from pytest_garl.plugin.terminal_text import begin_line

if TYPE_CHECKING:
    from pytest_garl.plugin.session.run import Run


def write_summary(reporter: Any, config: pytest.Config, tally: Tally) -> None:
    """Write films, findings, cases, pages, GitHub's step summary, and why a run is not green."""
    with _one_line_if_broken(reporter, "the summary"):
        _join_workers(config, tally)
    run = config.stash.get(RUN, None)
    if run is not None:
        _write_run(reporter, run, tally)
    else:
        with _one_line_if_broken(reporter, "the step summary"):
            from pytest_garl.plugin.terminal.github_summary import write_failures_alone

            write_failures_alone(reporter)
    if tally.items or tally.problems:
        with _one_line_if_broken(reporter, "the summary"):
            from pytest_garl.plugin.terminal.summary import write_status

            write_status(reporter, tally)


def _join_workers(config: pytest.Config, tally: Tally) -> None:
    """Open the ledger of the saved cases that xdist's workers flew."""
    if RUN not in config.stash and tally.items and config.pluginmanager.hasplugin("dsession"):
        from pytest_garl.plugin.options import options_of
        from pytest_garl.plugin.session.startup import join_workers

        join_workers(config, options_of(config))


def _write_run(reporter: Any, run: Run, tally: Tally) -> None:
    report = None
    with _one_line_if_broken(reporter, "the films"):
        if run.options.film:
            from pytest_garl.plugin.terminal.failure_films import draw_failures

            run.films = draw_failures(reporter, run, tally)
    with _one_line_if_broken(reporter, "the summary"):
        from pytest_garl.plugin.terminal.summary import write_run

        write_run(reporter, run, tally)
    # Without a record the line above says why: nothing more is known of the searches.
    record = tally.record
    with _one_line_if_broken(reporter, "the pages"):
        from pytest_garl.plugin.terminal.pages import write_pages

        report = write_pages(reporter, run, record) if record else None
    with _one_line_if_broken(reporter, "the step summary"):
        from pytest_garl.plugin.terminal.github_summary import (
            write_failures_alone,
            write_step_summary,
        )

        if record:
            write_step_summary(reporter, run, record, report)
        else:
            write_failures_alone(reporter)


@contextlib.contextmanager
def _one_line_if_broken(reporter: Any, part: str) -> Iterator[None]:
    """Write an error in one line: pytest's own summary and those of other plugins follow.

    The session is not green then, because nobody can read what else was found.
    """
    try:
        yield
    except Exception as error:  # noqa: BLE001 (whatever it is, the session's report goes on)
        from pytest_garl.plugin.session.session_status import fail_broken_session, problem_text

        fail_broken_session(reporter.config)
        begin_line(reporter)
        reporter.write_line(f"garl: {problem_text(part, error)}", red=True)
