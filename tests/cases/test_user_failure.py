from __future__ import annotations

from pytest_garl.cases.user_failure import UserFailure


def test_signature_names_test_and_assertion() -> None:
    failure = UserFailure(test="test_own", assertion="12345678", message="", attributes=frozenset())
    assert failure.signature == "own:test_own:12345678"
