"""The exit status of a session, decided from facts alone."""

from __future__ import annotations

import pytest

from pytest_garl.plugin.session_status import SessionFacts, exit_status

ExitCode = pytest.ExitCode
GREEN, RED, EMPTY = ExitCode.OK, ExitCode.TESTS_FAILED, ExitCode.NO_TESTS_COLLECTED
INTERRUPTED, USAGE, INTERNAL = (
    ExitCode.INTERRUPTED,
    ExitCode.USAGE_ERROR,
    ExitCode.INTERNAL_ERROR,
)


@pytest.mark.parametrize(
    ("status", "facts", "decided"),
    [
        (GREEN, SessionFacts(), GREEN),
        (RED, SessionFacts(), RED),
        (GREEN, SessionFacts(problems=True), RED),
        (RED, SessionFacts(problems=True), RED),
        (INTERRUPTED, SessionFacts(problems=True), INTERRUPTED),
        (GREEN, SessionFacts(broken=True), INTERNAL),
        (RED, SessionFacts(broken=True, problems=True), INTERNAL),
        (GREEN, SessionFacts(nothing_compared=True), USAGE),
        (EMPTY, SessionFacts(nothing_compared=True), USAGE),
        (RED, SessionFacts(nothing_compared=True), RED),
        (GREEN, SessionFacts(nothing_compared=True, problems=True), USAGE),
    ],
)
def test_exit_status_is_worst_of_items_and_session(
    status: int, facts: SessionFacts, decided: int
) -> None:
    assert exit_status(status, facts) == decided
