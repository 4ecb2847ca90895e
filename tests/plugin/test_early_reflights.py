from __future__ import annotations

import pytest

from pytest_garl.execution.ledger import Ledger
from tests.support.case_project import SEARCH, replace_text, run, violations
from tests.support.landing_project import project

UNSHRUNK = (*SEARCH, "--garl-method=random", "--garl-shrink=0")


def requested(pytester: pytest.Pytester) -> int:
    """Return how many repeat flights the last search requested."""
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    try:
        query = "SELECT count(*) FROM search WHERE kind = 'on_demand'"
        return int(ledger.database.execute(query).fetchone()[0])
    finally:
        ledger.close()


def test_each_failing_signature_is_flown_again_once(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, *UNSHRUNK)
    signatures = {signature for _, _, signature in violations(pytester)}
    assert len(signatures) > 1
    assert result.parseoutcomes()["failed"] == requested(pytester) == len(signatures)


def test_repeat_flights_are_requested_before_all_have_reported(pytester: pytest.Pytester) -> None:
    project(pytester)
    conftest = pytester.path / "conftest.py"
    last_first = "\ndef pytest_collection_modifyitems(items):\n    items.reverse()\n"
    conftest.write_text(conftest.read_text() + last_first)
    result = run(pytester, *UNSHRUNK, "--exitfirst")
    assert result.parseoutcomes()["failed"] == 1
    signatures = {signature for _, _, signature in violations(pytester)}
    assert requested(pytester) == len(signatures) > 1


def test_violations_that_no_test_reports_are_not_flown_again(pytester: pytest.Pytester) -> None:
    project(pytester)
    tests = pytester.path / "test_it.py"
    # Their failures are expected, so that no test reports them.
    replace_text(tests, "def test_", "@pytest.mark.xfail\ndef test_")
    outcomes = run(pytester, *UNSHRUNK).parseoutcomes()
    assert "failed" not in outcomes
    assert outcomes["xfailed"] >= len(violations(pytester)) > 1
    assert requested(pytester) == 0
