"""Which violations of a search the known cases excuse.

A case excuses a violation that ends as the case does, if it has the case's cause and is no worse:

1. Something of the cause acts in the flight.  A flight in which all of it is nominal fails for
   another reason.  That costs no flight.
2. Neither its margin is worse nor its adversary weaker than the worst violation of the kind in the
   search that saved the case.  A file without that figure sets no bound.
3. The twin does not end alike.  The twin is the same scenario with the causes of all known cases of
   the kind made nominal.  If it fails all the same, the kind has another cause as well, and nothing
   of the kind is excused; unless a known case fails with nothing unusual and ends as the twin.  A
   raw flight has more conditions than a shrunk case, so their number tells nothing; what is left
   without the known cause does.

One twin is flown for each kind: that of the first violation, by generation and slot, that passes
1 and 2.  An empty cause and one that the ending names have no twin: there is nothing to take away.
So a search of 5 known kinds takes at most 5 flights more.

Example: a case "II:gave-up-in-sight:search:light" is known.  The search finds three violations with
this ending: in fog; in dim light with wind; in dim light with the nose to the south.  The first is
investigated as new, because its light is nominal.  The twin of the second has wind alone, and
lands: both others are excused, if they are no worse.

All is decided generation by generation, from flights of the ledger, so that it is the same for any
number of workers and in a resumed run.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pytest_garl.cases.case import Case
from pytest_garl.cases.shrunk_cause import Cause, cause_of_case
from pytest_garl.cases.worst import why_worse
from pytest_garl.execution.flight_id import FlightId, search_key
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import Verdict, cause_of


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownCase:
    """A case that may excuse violations, and the name of its file."""

    name: str
    case: Case


@dataclass(frozen=True, slots=True, kw_only=True)
class Twin:
    """The twin of a kind's first violation: its flight, its scenario, the cause it lacks."""

    flight: FlightId
    scenario: Scenario
    cause: Cause


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownCaseMatch:
    """The case that excuses a violation, None if none does; ``reason`` says why not."""

    known: KnownCase | None
    reason: str = ""


class KnownKinds:
    """What known cases of one landing system on one map excuse in one search."""

    def __init__(
        self, ledger: Ledger, search: str, job: FlightJob, known: Iterable[KnownCase]
    ) -> None:
        self._ledger, self._search, self._job = ledger, search, job
        self._map = job.load_map()
        self._known: dict[str, list[KnownCase]] = {}
        for each in known:
            self._known.setdefault(each.case.ending, []).append(each)
        self._twins: dict[str, Twin | None] = {}
        self._latest = -1

    def __contains__(self, ending: str) -> bool:
        """Return whether a case of this ending is known."""
        return ending in self._known

    def files(self, ending: str) -> tuple[str, ...]:
        """Return the names of the known cases of an ending."""
        return tuple(each.name for each in self._known.get(ending, ()))

    def advance(self) -> None:
        """Request the twins of the kinds in the generations that were flown since the last call."""
        for generation in self._ledger.queries.closed_generations(self._search, self._latest):
            for flight in self._ledger.queries.violating(self._search, generation):
                ending = flight.signature
                if ending in self._known and ending not in self._twins:
                    scenario = parse_scenario(flight.scenario)
                    if self.without_twin(flight.result, scenario).known is not None:
                        self._twins[ending] = self._request(ending, scenario)
            self._latest = generation

    def is_closed(self, generation: int) -> bool:
        """Return whether a generation and all before it were flown when it was called last."""
        return generation <= self._latest

    def without_twin(self, result: FlightResult, scenario: Scenario) -> KnownCaseMatch:
        """Return what a violation's own flight says: whether a case has its cause and is as bad."""
        known = self._known.get(result.signature, ())
        acting = [each for each in known if cause_of_case(each.case).acts_in(scenario)]
        if not acting:
            causes = "; ".join(cause_of_case(each.case).text for each in known)
            return KnownCaseMatch(known=None, reason=f"its cause ({causes}) is nominal here")
        # The file that names a cause says more than one that takes nothing.
        acting.sort(key=lambda each: not cause_of_case(each.case))
        reasons = [why_worse(result, each.case.worst) for each in acting]
        for each, reason in zip(acting, reasons, strict=True):
            if not reason:
                return KnownCaseMatch(known=each)
        return KnownCaseMatch(known=None, reason=reasons[0])

    def twin(self, ending: str) -> Twin | None:
        """Return the twin of a kind; None if it has none, or no violation that needs one yet."""
        return self._twins.get(ending)

    def is_refuted(self, ending: str, twin: Twin, flown: FlightResult) -> bool:
        """Return whether the twin of a kind fails alike, for a cause that no case knows."""
        if not fails_alike(flown.verdict, ending):
            return False
        return self.without_twin(flown, twin.scenario).known is None

    def alike(self, ending: str) -> list[Case]:
        """Return the known cases whose endings differ from this one in phase and sight at most."""
        cases = [each.case for known in self._known.values() for each in known]
        return [each for each in cases if are_alike(each.ending, ending)]

    def _request(self, ending: str, scenario: Scenario) -> Twin | None:
        cases = self.alike(ending)
        return request_twin(self._ledger, self._search, self._job, scenario, cases)


def request_twin(
    ledger: Ledger, search: str, job: FlightJob, scenario: Scenario, cases: Iterable[Case]
) -> Twin | None:
    """Request the flight of a scenario without the causes of cases, unless it was requested.

    Returns None if none of the causes acts in it.
    """
    cause = Cause()
    for case in cases:
        cause |= cause_of_case(case)
    if not cause or not cause.acts_in(scenario):
        return None
    twin = cause.made_nominal(scenario, job.load_map())
    text = dump_scenario(twin)
    flight = FlightId(search=search_key(f"twin {search} {job.flown_facts()} {text}"), map=job.map)
    ledger.add_flight(flight, job.system.name, job.dumps(), text)
    ledger.facts.note_twin(flight.search, search)
    return Twin(flight=flight, scenario=twin, cause=cause)


def are_alike(ending: str, other: str) -> bool:
    """Return whether two endings differ in phase and sight at most."""
    first, second = cause_of(ending), cause_of(other)
    return first == second or {first, second} == {"off:seen", "off:unseen"}


def fails_alike(verdict: Verdict, ending: str) -> bool:
    """Return whether a flight violates a property in a way that is like an ending."""
    return verdict.violation and are_alike(verdict.ending, ending)
