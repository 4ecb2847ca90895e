"""What the landing tests in a file fly: pytest collects them, and nothing runs."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import pytest

from pytest_garl.errors import LandingSystemError
from pytest_garl.messages import python_that_lacks
from pytest_garl.plugin.items.keys import marker_of, takes_landing
from pytest_garl.plugin.items.marker import read_marker
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import options_of

LAST_LINES = 12
"""Lines of pytest's output that an error shows if no report says what went wrong."""


class _Collector:
    """A plugin that notes the targets of all landing tests, and why a file is not collected."""

    def __init__(self) -> None:
        self.targets: list[tuple[Target, tuple[Path, ...]]] = []
        self.problems: list[str] = []

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.problems.append(report.longreprtext)

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        for item in session.items:
            marker = marker_of(item)
            if marker is None or not takes_landing(item):
                continue
            options = options_of(session.config)
            targets = read_marker(marker, options).targets.values()
            self.targets += [(target, options.map_folders) for target in targets]


def targets_of(argument: str) -> list[tuple[Target, tuple[Path, ...]]]:
    """Return what the tests of a file, or one test ``file::name``, fly, and the folders of maps.

    pytest collects them in this process, with the project's own configuration, so that conftest
    files, classes and parametrised markers count.  Raises LandingSystemError if it cannot, or if
    none of them is a landing test.
    """
    collector, output = _Collector(), io.StringIO()
    # Nothing is asserted, and pytest would warn that this package is imported already.
    options = ["--collect-only", "-q", "--assert=plain", "-p", "no:cacheprovider"]
    options += ["--garl-budget=1", argument]
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        status = pytest.main(options, plugins=[collector])
    if collector.problems:
        problem = collector.problems[0]
        raise LandingSystemError(
            f"{argument}: pytest cannot collect it{python_that_lacks(problem)}:\n{problem}"
        )
    if status not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        last = "\n".join(output.getvalue().strip().splitlines()[-LAST_LINES:])
        raise LandingSystemError(f"{argument}: pytest cannot collect it:\n{last}")
    if not collector.targets:
        raise LandingSystemError(
            f"{argument}: found no landing test; expected one that takes the fixture `landing` and "
            "has @pytest.mark.garl(system=..., maps=[...])"
        )
    return collector.targets
