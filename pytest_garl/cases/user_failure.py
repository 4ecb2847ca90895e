"""A failed assertion of a user's test, and the interface to run the assertion on other flights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.scenarios.scenario import Scenario

ATTRIBUTES_OF_PROPERTY: dict[str, frozenset[str]] = {
    # A UAV may hit something after it has touched the ground off the marker.
    "distance": frozenset({"distance_to_landing_m", "final_distance_m", "collisions"}),
    "time": frozenset({"time_to_landing_s", "elapsed_s"}),
    "collision": frozenset({"collisions"}),
}
"""The attributes of a landing that belong to each built-in property."""
ATTRIBUTES_OF_ALL_PROPERTIES = frozenset({"outcome", "verdict", "result", "completed", "excused"})
"""The attributes that belong to every built-in property."""


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

    def is_about(self, name: str | None) -> bool:
        """Return whether the assertion reads attributes of the built-in property ``name``."""
        if name is None:
            return False
        return bool(
            self.attributes
            & (ATTRIBUTES_OF_ALL_PROPERTIES | ATTRIBUTES_OF_PROPERTY.get(name, frozenset({name})))
        )


class UserAssertion(Protocol):
    """A user's assertion, which can run on any flight."""

    def __call__(self, flight: CompletedFlight, scenario: Scenario) -> UserFailure | None:
        """Return how the test fails on a flight without built-in violation, or None."""
