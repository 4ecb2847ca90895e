"""The violations of a search by signature, for the terminal, GitHub and ``garl report``."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from types import MappingProxyType
from typing import Self, TypeVar

from pytest_garl.cases.case import Case
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.severity import Severity
from pytest_garl.reports.causes import cause_of, counted_causes, telling_case, title_of
from pytest_garl.reports.control_arm import ControlArm, control_arm, is_control
from pytest_garl.verdicts.kinds import hill_number
from pytest_garl.verdicts.verdict import Limits, NoLanding, Verdict
from pytest_garl.verdicts.wording import headline

T = TypeVar("T")
WHY_NO_LANDING: tuple[NoLanding, ...] = ("needless", "excused", "blocked")
"""Columns of the flights without landing: somebody could have landed; nobody could have read the
marker for long enough; something never left it free for long enough."""


NONE: Mapping[str, tuple[Severity, str]] = MappingProxyType({})
NEVER_GAVE_UP = "late:never-gave-up"
_BLOCKED = "The marker was blocked"
"""In the story of a flight in which something never left the marker free for long enough."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SlotUserFailure:
    """A failed assertion about a user's own property, in the flight of a slot.

    The ledger stores these fields as JSON with these names.
    """

    system: str
    map: str
    slot: str
    signature: str
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ViolationKind:
    """All violations with one signature, or all findings that came before another event.

    ``count`` is the number of flights, ``first`` the slot of the first one, ``story`` what happened
    in it, and ``headline`` the story in short.  ``severity`` is the lowest of these flights, None
    if none is known, and ``severest`` the first slot with it.  ``in_control`` is the number of
    random flights that show it, None without a control arm to compare with.  ``slots`` are those of
    the flights.  ``case`` is the shrunk case that tells its cause, None if nobody knows the cause.
    """

    signature: str
    count: int
    first: str
    story: str
    headline: str
    severity: Severity | None = None
    severest: str = ""
    in_control: int | None = None
    slots: tuple[str, ...] = ()
    case: Case | None = None

    @property
    def title(self) -> str:
        """The cause and the ending in a few words; empty if nobody knows the cause."""
        return title_of(self.case) if self.case else ""

    @property
    def least(self) -> str:
        """What it takes at the least, of a shrunk case; else what was unusual in its flights.

        It may be empty.
        """
        if self.case is not None:
            return f"at the least: {self.case.severity.text}"
        if self.severity is None or not self.severity.about:
            return ""
        return f"unusual in {self.severest}: {self.severity.unusual or 'nothing'}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """The median and the worst, which is the largest, of a quantity over flights that landed."""

    median: float
    worst: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Self | None:
        """Return the spread of values, None if there are none."""
        return cls(median=statistics.median(values), worst=max(values)) if values else None


def _why_no_landing(verdict: Verdict) -> NoLanding:
    """Return why a flight did not land.

    One that never gave up where nobody could have landed violates something, so its verdict has no
    excuse; but it was not needless that it did not land.
    """
    if verdict.cause != NEVER_GAVE_UP:
        return verdict.no_landing
    return "blocked" if _BLOCKED in verdict.story else "excused"


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSummary:
    """All flights of a system on a map, and their kinds of violation, the most frequent first.

    ``findings`` are what had gone wrong before the event that decided a flight.  ``limits`` are
    those of the marker; there are several only if markers of one system differ.
    """

    system: str
    map: str
    files: tuple[str, ...]
    """The test files of the system."""
    flights: tuple[LedgerFlight, ...]
    kinds: tuple[ViolationKind, ...]
    violating: int
    """How many flights violate a property, built in or a user's own."""
    findings: tuple[ViolationKind, ...] = ()
    limits: tuple[Limits, ...] = ()
    domains: tuple[str, ...] = ()
    """Names of the domains, of a file with a digest; several only if markers differ."""
    npcs: tuple[str, ...] = ()
    """Names of the policies that moved the NPCs."""
    control: ControlArm | None = None
    """The random flights beside the later ones; None if the method has none."""

    @property
    def random_flights(self) -> int:
        """The number of flights of the control arm, 0 without one."""
        return self.control.random.flights if self.control else 0

    @property
    def causes(self) -> str:
        """How many causes its kinds have, in words; empty if none is known."""
        return counted_causes([kind.case for kind in self.kinds])

    def with_cases(self, cases: Sequence[Case]) -> Self:
        """Return it with the causes that cases tell; kinds of one cause stand together."""
        told = [
            dataclasses.replace(
                kind, case=telling_case(cases, self.system, self.map, kind.signature)
            )
            for kind in self.kinds
        ]
        return dataclasses.replace(self, kinds=tuple(by_cause(told, lambda kind: kind)))

    @property
    def effective_kinds(self) -> float:
        """The Hill number of order 1 of the kinds of violation."""
        return hill_number([kind.count for kind in self.kinds], 1)

    @property
    def name(self) -> str:
        """The name of the landing system's class."""
        return self.system.split(":")[-1]

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts of the flights."""
        return tuple(each.result.verdict for each in self.flights)

    def flight(self, slot: str) -> LedgerFlight:
        """Return the flight of a slot, such as ``court-g03-s17``."""
        return next(each for each in self.flights if each.id.slot_id == slot)

    def count(self, outcome: str) -> int:
        """Return how many flights had an outcome."""
        return sum(each.result.outcome == outcome for each in self.flights)

    def without_landing(self, outcome: str) -> Mapping[str, int]:
        """Return how many flights with the outcome gave_up or not_landed had which reason."""
        reasons = [
            _why_no_landing(each.result.verdict)
            for each in self.flights
            if each.result.outcome == outcome
        ]
        return {reason: reasons.count(reason) for reason in WHY_NO_LANDING}

    @property
    def completed(self) -> int:
        """How many flights landed within the limit of distance."""
        return sum(verdict.completed for verdict in self.verdicts)

    @property
    def violating_by_the_paper(self) -> int:
        """How many flights violate the paper's definition, by which no landing is a violation."""
        return sum(verdict.paper_violation for verdict in self.verdicts)

    @property
    def landing_distance_m(self) -> Spread | None:
        """The distance from the marker of the flights that landed; None if none did."""
        return Spread.of([each.result.final_distance_m for each in self._landed])

    @property
    def landing_time_s(self) -> Spread | None:
        """The time of the touchdown of the flights that landed; None if none did."""
        results = [each.result for each in self._landed]
        return Spread.of(
            [each.elapsed_s if each.landed_s is None else each.landed_s for each in results]
        )

    @property
    def _landed(self) -> list[LedgerFlight]:
        return [each for each in self.flights if each.result.outcome == "landed"]

    @property
    def crashes(self) -> Mapping[str, int]:
        """How often the landing system crashed, by kind of crash; without inconclusive flights."""
        counts: dict[str, int] = {}
        for each in self.flights:
            if each.result.verdict.violation_type == "V":
                kind = each.result.crash.kind if each.result.crash else "raised"
                name = kind if kind in ("died", "hung", "broke") else "Python error"
                counts[name] = counts.get(name, 0) + 1
        return counts


def search_summaries(
    ledger: Ledger, user_failures: Iterable[SlotUserFailure] = ()
) -> list[SearchSummary]:
    """Return the summary of each search in a ledger."""
    flown: dict[tuple[str, str], list[LedgerFlight]] = {}
    for flight in ledger.queries.flights():
        flown.setdefault((flight.system, flight.id.map), []).append(flight)
    failures: dict[tuple[str, str], list[SlotUserFailure]] = {}
    for each in user_failures:
        failures.setdefault((each.system, each.map), []).append(each)
    method = ledger.facts.method
    return [
        _summary(ledger, system, map, method, flights, failures.get((system, map), []))
        for (system, map), flights in flown.items()
    ]


def _summary(
    ledger: Ledger,
    system: str,
    map: str,
    method: str | None,
    flights: list[LedgerFlight],
    user_failures: list[SlotUserFailure],
) -> SearchSummary:
    # (slot, story) of all violations, by signature.
    violations: dict[str, list[tuple[str, str]]] = {}
    for flight in flights:
        verdict = flight.result.verdict
        if verdict.violation:
            violation = flight.id.slot_id, verdict.story
            violations.setdefault(verdict.ending, []).append(violation)
    for each in sorted(user_failures, key=lambda each: each.slot):
        violations.setdefault(each.signature, []).append((each.slot, each.message))
    findings: dict[str, list[tuple[str, str]]] = {}
    for flight in flights:
        for finding in flight.result.verdict.findings:
            before = flight.id.slot_id, finding.story
            findings.setdefault(finding.signature, []).append(before)
    jobs = _jobs(ledger, flights)
    control = control_arm(method, flights)
    random = {f.id.slot_id for f in flights if is_control(method, f.id.slot.generation)}
    compares = control is not None and control.later.flights > 0
    return SearchSummary(
        system=system,
        map=map,
        files=ledger.facts.files(system, map),
        flights=tuple(flights),
        kinds=_kinds(violations, _lowest_severities(flights), random if compares else None),
        violating=len({slot for items in violations.values() for slot, _ in items}),
        findings=_kinds(findings),
        limits=tuple(dict.fromkeys(job.limits for job in jobs)),
        domains=ledger.facts.domains(system, map),
        npcs=tuple(dict.fromkeys(job.npcs.name for job in jobs)),
        control=control,
    )


def by_cause(shown: Iterable[T], kind_of: Callable[[T], ViolationKind]) -> list[T]:
    """Return what shows kinds, those of one cause together, the most frequent cause first.

    A kind of which nobody knows the cause stands for itself.  The order within a cause is kept, and
    so is that of causes which are equally frequent.
    """
    groups: dict[tuple[str, ...], list[T]] = {}
    for number, each in enumerate(shown):
        case = kind_of(each).case
        key = cause_of(case.severity) if case else ("", str(number))
        groups.setdefault(key, []).append(each)
    ordered = sorted(groups.values(), key=lambda group: -sum(kind_of(e).count for e in group))
    return [each for group in ordered for each in group]


def _lowest_severities(flights: Sequence[LedgerFlight]) -> dict[str, tuple[Severity, str]]:
    """Return the lowest severity of the violations and its first slot, by signature."""
    lowest: dict[str, tuple[Severity, str]] = {}
    for flight in flights:
        result = flight.result
        if result.verdict.violation and result.severity is not None:
            known = lowest.get(result.signature)
            if known is None or result.severity < known[0]:
                lowest[result.signature] = (result.severity, flight.id.slot_id)
    return lowest


def _kinds(
    stories: Mapping[str, Sequence[tuple[str, str]]],
    severities: Mapping[str, tuple[Severity, str]] = NONE,
    random_slots: Set[str] | None = None,
) -> tuple[ViolationKind, ...]:
    """Return the kinds in (slot, story) by signature, the most frequent first."""
    kinds = [
        ViolationKind(
            signature=signature,
            count=len({slot for slot, _ in items}),
            first=items[0][0],
            story=items[0][1],
            headline=headline(items[0][1]),
            severity=severities[signature][0] if signature in severities else None,
            severest=severities[signature][1] if signature in severities else "",
            in_control=None
            if random_slots is None
            else len({slot for slot, _ in items} & random_slots),
            slots=tuple(dict.fromkeys(slot for slot, _ in items)),
        )
        for signature, items in stories.items()
    ]
    return tuple(sorted(kinds, key=lambda each: (-each.count, each.signature)))


def _jobs(ledger: Ledger, flights: Sequence[LedgerFlight]) -> list[FlightJob]:
    jobs = [ledger.job(search) for search in dict.fromkeys(each.id.search for each in flights)]
    return [parse_job(job) for job in jobs if job is not None]


LEGEND = {
    "I": "came down off the marker, on something else or on nothing",
    "II": "did not land: the marker could never be read, was lost, or was readable to the end",
    "III": "hit a fixed body",
    "IV": "hit a moving body",
    "V": "Python error, death or hang of the landing system",
    "late": "landed too late, or let the time run out in sight of the marker, on the ground or "
    "without giving up",
    "off": "came down too far from the marker, up to 1.5 m",
    "hard": "touched down too fast or tilted",
    "slid": "moved on over the ground after its touchdown",
    "abort": 'gave up where nobody could land, with limits(abort="violation")',
    "own": "an assertion of a test",
    "slow": "took more than three times as long as a nominal landing",
    "lost-while-detectable": "did not report the marker while it could be read",
}
"""Meanings of the types of violations and findings: a signature's part before the first colon."""


def legend(kinds: Iterable[ViolationKind]) -> str:
    """Return the meanings of the types of these kinds, in one line."""
    types = {kind.signature.partition(":")[0] for kind in kinds}
    return "; ".join(f"{name}: {meaning}" for name, meaning in LEGEND.items() if name in types)
