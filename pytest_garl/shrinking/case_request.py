"""A request to make a case of a violation, and its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pytest_garl.cases.case import Case, RecordedBehaviour
from pytest_garl.cases.user_failure import UserAssertion
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.simplification import Complexity, complexity, genome_of_scenario
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import cause_of

LEAST_WINDOW_S = 1.0
"""An entry whose window is shorter sits on an edge."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseRequest:
    """A request to make a case of one signature of one search.

    ``violations`` are scenarios with the flights that violated, in slot order.  ``name`` begins
    with the search.  ``budget`` limits the flights.  ``user_assertion`` is the test's assertion
    that failed, None for the built-in verdict; ``test`` is the node id of the test that found it.
    ``finding`` is the signature of what had gone wrong before the end of these flights, empty for a
    request about their violation; ``known`` are the signatures that get a case without it.
    """

    name: str
    signature: str
    violations: tuple[tuple[Scenario, CompletedFlight], ...]
    job: FlightJob
    map: Map
    budget: int
    user_assertion: UserAssertion | None = None
    test: str = ""
    finding: str = ""
    known: tuple[str, ...] = ()

    @property
    def search(self) -> str:
        """The key of the search that found the violations."""
        return self.name.partition(" ")[0]

    @property
    def is_exception(self) -> bool:
        """Whether the landing system raised, returned nonsense or hung.

        The traceback explains more than a scenario can, and each flight that hangs costs four times
        the limit of a call.
        """
        if self.user_assertion is not None or self.finding or not self.violations:
            return False
        crash = self.violations[0][1].result.crash
        return crash is not None and crash.kind in ("raised", "nonsense", "hung")

    @property
    def asks_prevention(self) -> bool:
        """Whether the violation is a collision with a moving body, which may be unpreventable."""
        return self.user_assertion is None and self.signature.startswith("IV:")

    @property
    def scenarios(self) -> list[Scenario]:
        """The scenarios of the violations: the first, then the others, the simplest first.

        Those of collisions with moving bodies are in the order of severity, weak adversaries first.
        """
        return [
            *(scenario for scenario, _ in self.violations[:1]),
            *self._sorted(self.violations[1:]),
        ]

    @property
    def simplest(self) -> Scenario:
        """The scenario of the simplest or least severe violation."""
        return self._sorted(self.violations)[0]

    def _sorted(self, violations: Sequence[tuple[Scenario, CompletedFlight]]) -> list[Scenario]:
        found = dict(violations)
        return sorted(found, key=lambda each: self._order(found, each))

    def _order(
        self, found: Mapping[Scenario, CompletedFlight], scenario: Scenario
    ) -> tuple[tuple[float, ...], Complexity]:
        severity = found[scenario].result.severity if self.asks_prevention else None
        key = () if severity is None else severity.key
        return key, complexity(scenario, genome_of_scenario(scenario, self.map))

    def fails(self, scenario: Scenario, flight: CompletedFlight) -> bool:
        """Return whether a flight fails with this request's signature."""
        if self.user_assertion is None:
            return flight.signature == self.signature
        failure = self.user_assertion(flight, scenario)
        return failure is not None and failure.signature == self.signature

    def fails_alike(self, flight: CompletedFlight) -> bool:
        """Return whether a flight violates the same property by the same kind of body.

        The phase of the landing and what the camera showed may be others.
        """
        return flight.result.verdict.cause == cause_of(self.signature)


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseResult:
    """The case that was made, or the reason why there is none.

    ``finding`` is the signature of what had gone wrong before the end of the flights that were
    flown again without NPCs, empty for a case of their violation.
    """

    signature: str
    case: Case | None
    flights: int
    reason: str = ""
    finding: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class FailingScenario:
    """A scenario that fails, what its objects did, and its flight.

    ``origin`` is the scenario of the search that it was made from.  Of
    ``neighbours_flown`` slightly different scenarios, ``neighbours_failed`` fail in the same way.
    ``npcs`` is the policy that moved the objects, None for that of the search.  ``window_s`` is how
    long the entry of a crossing object may be shifted so that it is still hit; None if that was not
    measured.
    """

    origin: Scenario
    scenario: Scenario
    behaviour: RecordedBehaviour
    flight: CompletedFlight
    neighbours_failed: int = 0
    neighbours_flown: int = 0
    npcs: PolicySpec | None = None
    window_s: float | None = None

    @property
    def is_shrunk(self) -> bool:
        """Whether flights showed what it takes; else it is as the search found it."""
        return bool(self.neighbours_flown) or self.window_s is not None

    @property
    def is_robust(self) -> bool:
        """Whether the case gates: the entry has a window, or all neighbours fail."""
        if self.window_s is not None:
            return self.window_s >= LEAST_WINDOW_S
        return self.neighbours_failed == self.neighbours_flown
