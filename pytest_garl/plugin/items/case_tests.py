"""Collect the tests that found a saved case, with their simulator, files and assertions."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.cases.case_test_run import pytest_arguments, single_case_corpus
from pytest_garl.errors import GarlError
from pytest_garl.execution.reference import BUILT_IN, Reference, reference_to
from pytest_garl.execution.sources import data_files
from pytest_garl.plugin.items.keys import target_of
from pytest_garl.plugin.items.user_assertions import ItemAssertion
from pytest_garl.shrinking.reshrink import CaseSetup

_IGNORE_IMPORTED = "ignore::pytest.PytestAssertRewriteWarning"
"""pytest warns that this package is imported already; a project may turn warnings into errors."""


class _Collector:
    """A plugin that keeps what pytest collects."""

    def __init__(self) -> None:
        self.items: list[pytest.Item] = []
        self.simulator: Reference = BUILT_IN

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Keep the items, and the simulator of the project."""
        self.items = list(session.items)
        fly = session.config.hook.pytest_garl_fly(config=session.config)
        self.simulator = reference_to(fly) if fly else BUILT_IN


def case_setup(case: Case, root: Path) -> CaseSetup:
    """Return how the tests that found a case fly and judge it.

    Raises GarlError if they cannot be collected, or lack the test of a user's own property.
    """
    if not case.test:
        return CaseSetup()
    collector = _Collector()
    with single_case_corpus(case, live=False) as folder, contextlib.chdir(root):
        output = io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            options = ["--collect-only", "-q", "--capture=no", f"-W{_IGNORE_IMPORTED}"]
            status = pytest.main(
                [*pytest_arguments(case, folder, live=False), *options], [collector]
            )
    tests = [
        (item, target)
        for item in collector.items
        if isinstance(item, pytest.Function) and (target := target_of(item)) is not None
    ]
    if status not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        raise GarlError(f"pytest could not collect {case.test}:\n{output.getvalue()}")
    for item, target in tests:
        if case.asserting_test and item.originalname != case.asserting_test:
            continue
        return CaseSetup(
            user_assertion=ItemAssertion(item, target) if case.assertion else None,
            simulator=collector.simulator,
            files=tuple(data_files(target.files, root).items()),
        )
    if not case.assertion:
        return CaseSetup(simulator=collector.simulator)
    raise GarlError(
        f"the case {case.id} tests a property of your own, but its test {case.test!r} is not found "
        f"in {root}; run this where you run pytest, or correct the case's key 'test'"
    )
