"""A failed assertion of a user's test, and the interface to run the assertion on other flights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.scenarios.scenario import Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class UserFailure:
    """A failed assertion of a user's test.

    ``assertion`` is the hash of the statement in the test's body, even if a function that it calls
    raised; ``attributes`` are the landing's attributes that the statement reads.
    """

    test: str
    assertion: str
    message: str
    attributes: frozenset[str]

    @property
    def signature(self) -> str:
        """The signature of a violation of the user's own property."""
        return f"own:{self.test}:{self.assertion}"


class UserAssertion(Protocol):
    """A user's assertion, which can run on any flight."""

    def __call__(self, flight: CompletedFlight, scenario: Scenario) -> UserFailure | None:
        """Return how the test fails on a flight without built-in violation, or None."""
