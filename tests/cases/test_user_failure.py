from __future__ import annotations

import pytest

from pytest_garl.cases.user_failure import UserFailure


def failure(*attributes: str) -> UserFailure:
    return UserFailure(
        test="test_own", assertion="12345678", message="", attributes=frozenset(attributes)
    )


def test_signature_names_test_and_assertion() -> None:
    assert failure().signature == "own:test_own:12345678"


@pytest.mark.parametrize(
    ("attribute", "name", "about"),
    [
        ("distance_to_landing_m", "distance", True),
        ("elapsed_s", "time", True),
        ("collisions", "collision", True),
        ("collisions", "distance", True),
        ("outcome", "distance", True),
        ("outcome", None, False),
        ("crash", "crash", True),
    ],
)
def test_failure_is_about_the_property_that_its_statement_reads(
    attribute: str, name: str | None, about: bool
) -> None:
    assert failure(attribute).is_about(name) is about
