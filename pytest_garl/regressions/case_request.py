"""What is to be found out about a violation, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.case import Case, RecordedBehaviour
from pytest_garl.regressions.robustness import COUNT
from pytest_garl.regressions.shrink import complexity, genome_of
from pytest_garl.regressions.user_failure import UserAssertion
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseRequest:
    """What is to be found out about one signature of one search.

    ``violations`` are scenarios with the flights that violated.  ``name`` begins with the search.
    ``budget`` bounds the flights, ``cap`` those of the landing system for all signatures of the
    search together unless it is None.  ``user_assertion`` is the assertion that failed, None for
    the built-in verdict; ``test`` is the node id of the test that found it.
    """

    name: str
    signature: str
    violations: tuple[tuple[Scenario, CompletedFlight], ...]
    job: FlightJob
    map: Map
    budget: int
    user_assertion: UserAssertion | None = None
    test: str = ""
    cap: int | None = None

    @property
    def search(self) -> str:
        """The search that found it."""
        return self.name.partition(" ")[0]

    @property
    def exception(self) -> bool:
        """Whether the landing system raised, returned nonsense or hung.

        No scenario explains more than the traceback does, and each flight that hangs costs four
        times the limit of a call.
        """
        if self.user_assertion is not None or not self.violations:
            return False
        crash = self.violations[0][1].result.crash
        return crash is not None and crash.kind in ("raised", "nonsense", "hung")

    def failed(self, scenario: Scenario, done: CompletedFlight) -> bool:
        """Whether a flight failed in the way that is asked about."""
        if self.user_assertion is None:
            return done.signature == self.signature
        own = self.user_assertion(done.result, done.record, scenario)
        return own is not None and own.signature == self.signature


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseResult:
    """What came of it: a case, or the reason why there is none."""

    signature: str
    case: Case | None
    flights: int
    piloted: int = 0
    """How many of the flights are the reference pilot's, which sees without a camera: they take a
    fraction of the time."""
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A scenario that fails, what its objects did, its flight, how many neighbours fail too.

    ``first`` is the search's scenario that it was made from; ``asked`` how many neighbours were
    flown.
    """

    first: Scenario
    scenario: Scenario
    behaviour: RecordedBehaviour
    done: CompletedFlight
    robust: int
    asked: int = COUNT


def simplest_first(request: CaseRequest) -> list[Scenario]:
    """Return the violations' scenarios, the simplest first."""
    return sorted(
        (scenario for scenario, _ in request.violations),
        key=lambda each: complexity(each, genome_of(each, request.map)),
    )
