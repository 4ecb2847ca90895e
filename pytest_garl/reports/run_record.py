"""A run, read once from its ledger and the saved cases: each figure that an output shows.

The terminal, GitHub's step summary, the pages, JSON and the comparison of two runs only put a
record into words: they read no ledger and count nothing, so that they cannot disagree.  A figure
is a field or a property here, of the run, of a search or of a kind of violation.
"""

from __future__ import annotations

import dataclasses
import itertools
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Self, TypeVar

from pytest_garl.cases.case import Case
from pytest_garl.cases.shrunk_cause import cause_of_case
from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.severity import Severity
from pytest_garl.npcs.director_progress import DirectorProgress, EventProgress
from pytest_garl.reports.causes import cause_of, tells_cause, title_of
from pytest_garl.reports.control_arm import ControlArm
from pytest_garl.reports.search_origins import (
    ModelRecord,
    MoverRecord,
    OriginRecord,
    StrikeRecord,
)
from pytest_garl.reports.sentences import (
    control_text,
    counted_causes,
    director_text,
    event_director_text,
    movers_text,
    origins_text,
    strikes_text,
)
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.verdicts.ending import ending_of
from pytest_garl.verdicts.kinds import hill_number
from pytest_garl.verdicts.paper_metrics import top_k
from pytest_garl.verdicts.statistics import share_interval
from pytest_garl.verdicts.verdict import Limits, NoLanding, PropertyName, Verdict, count_decided
from pytest_garl.verdicts.wording import headline

T = TypeVar("T")
Subject = Literal["control", "origins", "movers", "director", "strikes", "event director"]
"""What a sentence about a search tells of."""
WHY_NO_LANDING: tuple[NoLanding, ...] = ("needless", "excused", "blocked")
"""Columns of the flights without landing: somebody could have landed; nobody could have read the
marker for long enough; something never left it free for long enough."""
NEVER_GAVE_UP = "late:never-gave-up"
_BLOCKED = "The marker was blocked"
"""In the story of a flight in which something never left the marker free for long enough."""
_CRASHES = {"raised": "Python error", "nonsense": "wrong answer", "ended": "planner ended"}
"""What texts call a crash, if not by its kind."""
LANDED, IDLE, INCONCLUSIVE = "landed", "idle", "inconclusive"
"""Ends of flights that violate nothing; idle is one in which nobody could have landed."""
NO_PHASE = "not of a phase"
PHASES = (
    *("take-off", "transit", "search", "approach", "descent", "last-metre", "standing"),
    NO_PHASE,
)
"""Phases of a landing (``verdicts/evidence.py``), in its order, and what may begin in any."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedCase:
    """A saved case of one of the run's landing systems, without those of broken files.

    ``known`` says whether it is accepted.  ``flight`` is its flight in this ledger: None if there
    is none, or if no kind of the run ends as the case does.
    """

    path: Path
    case: Case
    known: bool
    flight: LedgerFlight | None = None

    @property
    def name(self) -> str:
        """The name in item ids: that of the file."""
        return self.path.stem


@dataclass(frozen=True, slots=True, kw_only=True)
class KindRecord:
    """All violations with one signature, or all findings that came before another event.

    ``slots`` are those of its flights, ``first`` is the first of them, and ``story`` what happened
    there.  ``severity`` is the lowest of these flights, None if none is known, and ``severest`` the
    first slot with it.  ``in_control`` is the number of random flights that show it, of
    ``random_flights``; None without a control arm to compare with.  ``repeat`` is the command that
    repeats the first flight, called beside the ledger.  ``saved`` are the saved cases that end as
    it does.  ``case`` is the shrunk case that tells its cause, None if nobody knows the cause, and
    ``told_by`` its name if it was shrunk from a flight that is none of these.
    """

    signature: str
    slots: tuple[str, ...]
    story: str
    severity: Severity | None = None
    severest: str = ""
    in_control: int | None = None
    random_flights: int = 0
    repeat: str = ""
    saved: tuple[SavedCase, ...] = ()
    case: Case | None = None
    told_by: str = ""

    @property
    def count(self) -> int:
        """The number of flights."""
        return len(self.slots)

    @property
    def first(self) -> str:
        """The slot of the first flight."""
        return self.slots[0]

    @property
    def headline(self) -> str:
        """The story in short."""
        return headline(self.story)

    @property
    def type(self) -> str:
        """The type of the violation: the signature's part before the first colon."""
        return self.signature.partition(":")[0]

    @property
    def phase(self) -> str:
        """The phase of the landing in which it begins; :data:`NO_PHASE` if it may be any."""
        parts = self.signature.split(":")[1:]
        return next((part for part in parts if part in PHASES), NO_PHASE)

    @property
    def cause(self) -> tuple[str, ...] | None:
        """The cause, None if nobody knows it."""
        return cause_of(self.case.severity) if self.case else None

    @property
    def title(self) -> str:
        """The cause and the ending in a few words; empty if nobody knows the cause."""
        return title_of(self.case) if self.case else ""

    @property
    def least(self) -> str:
        """The least that a shrunk case takes; otherwise what was unusual in its flights.

        It may be empty.
        """
        if self.case is not None:
            source = f", by {self.told_by}" if self.told_by else ""
            return f"at the least{source}: {self.case.severity.text}"
        if self.severity is None or not self.severity.about:
            return ""
        return f"unusual in {self.severest}: {self.severity.unusual or 'nothing'}"

    @property
    def seen_in_control(self) -> str:
        """In how many of the random flights it was seen; empty without a control arm."""
        if self.in_control is None:
            return ""
        return f"seen in {self.in_control} of {self.random_flights} random flights"

    @property
    def shown_case(self) -> SavedCase | None:
        """The saved case that tells its cause; else the first, None without one."""
        first = self.saved[0] if self.saved else None
        return next((each for each in self.saved if each.case == self.case), first)

    def with_cases(
        self,
        search: SearchKey,
        saved: Iterable[SavedCase],
        others: Sequence[Case] = (),
        flights: Sequence[LedgerFlight] = (),
    ) -> Self:
        """Return it with the saved cases of its search and ending, and the cause they tell.

        ``others`` may tell it too.  ``flights`` are its own: of several cases the one with the
        fewest conditions that was shrunk from one of them tells it, of equal ones that of the first
        flight.  The twin of another kind's flight may end alike, with nothing unusual, and its case
        has another cause.  So may a case of another search, which tells it only if a flight has all
        that the case takes.
        """
        place = search.system, search.map, ending_of(self.signature)
        mine = tuple(each for each in saved if place_of(each.case) == place)
        telling = [
            case
            for case in (*(each.case for each in mine), *others)
            if place_of(case) == place and tells_cause(case)
        ]
        # Shrinking and twins keep the seed of the flight with which they began.
        seeds = [each.seed for each in flights]
        if flights:
            flown = [parse_scenario(each.scenario) for each in flights]
            telling = [
                case
                for case in telling
                if case.scenario.seed in seeds or any(map(cause_of_case(case).is_in, flown))
            ]
        if len(telling) > 1:
            order = {seed: number for number, seed in reversed([*enumerate(seeds)])}
            telling.sort(key=lambda case: _order_of(case, order.get(case.scenario.seed)))
        case = next(iter(telling), None)
        others_name = ""
        if flights and case is not None and case.scenario.seed not in seeds:
            others_name = next((each.name for each in mine if each.case == case), "")
        return dataclasses.replace(self, saved=mine, case=case, told_by=others_name)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """The median and the worst (largest) of a quantity over flights that landed, in its unit."""

    median: float
    worst: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Self | None:
        """Return the spread of values, None if there are none."""
        return cls(median=statistics.median(values), worst=max(values)) if values else None


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchRecord:
    """The flights of a search so far, and their kinds of violation, the most frequent first.

    ``name`` is what texts call it.  ``findings`` are what had gone wrong before the event that
    decided a flight.
    """

    key: SearchKey
    name: str
    flights: tuple[LedgerFlight, ...]
    kinds: tuple[KindRecord, ...]
    violating: int
    """How many flights violate a property, built in or a user's own."""
    wanted: int = 0
    """How many flights it shall have."""
    findings: tuple[KindRecord, ...] = ()
    limits: tuple[Limits, ...] = ()
    """Those of the marker; several only if nobody noted which tests fly which."""
    npcs: tuple[str, ...] = ()
    """Names of the policies that moved the NPCs."""
    control: ControlArm | None = None
    """The random flights beside the later ones; None if the method has none."""
    origins: tuple[OriginRecord, ...] = ()
    """What the scenarios that were made in one way found; none if the method does not tell."""
    model: ModelRecord | None = None
    """How well the model of the landing system predicted; None without one."""
    movers: MoverRecord | None = None
    """Who moved the NPCs; None without NPCs."""
    director: DirectorProgress | None = None
    """What the flights say of the director that learned from them; None if none did."""
    strikes: StrikeRecord | None = None
    """Who let events strike; None without events."""
    event_director: EventProgress | None = None
    """What the flights say of the director of events; None if none learned from a strike."""
    camera: Mapping[str, Any] | None = None
    """What the ledger says of the landing system's camera; None if it does not."""

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts of the flights."""
        return tuple(each.result.verdict for each in self.flights)

    @property
    def by_slot(self) -> Mapping[str, LedgerFlight]:
        """The first flight of each slot, such as ``court-g03-s17``."""
        return {each.id.slot_id: each for each in reversed(self.flights)}

    @property
    def flown(self) -> int:
        """How many flights have a result."""
        return len(self.flights)

    @property
    def violating_interval(self) -> tuple[float, float]:
        """The 95 % interval of the share of flights that violate a property."""
        return share_interval(self.violating, self.flown)

    @property
    def violating_by_the_paper(self) -> int:
        """How many flights violate the paper's definition, by which no landing is a violation."""
        return sum(verdict.paper_violation for verdict in self.verdicts)

    @property
    def tenth_violation(self) -> int | None:
        """The flight with the tenth violation by the paper's definition; None with fewer."""
        return top_k(self.verdicts)

    @property
    def outcomes(self) -> Counter[str]:
        """How many flights had which outcome."""
        return Counter(each.result.outcome for each in self.flights)

    @property
    def landed(self) -> int:
        """How many flights landed, wherever that was."""
        return self.outcomes["landed"]

    @property
    def held(self) -> int:
        """How many flights held their place to the end."""
        return self.outcomes["held"]

    @property
    def completed(self) -> int:
        """How many flights landed within the limit of distance."""
        return sum(verdict.completed for verdict in self.verdicts)

    @property
    def completed_well(self) -> int:
        """How many of those that are ``completed`` violate no property built in."""
        return sum(verdict.completed and not verdict.violation for verdict in self.verdicts)

    @property
    def gave_up(self) -> Mapping[NoLanding, int]:
        """How many flights gave up for which reason."""
        return self._without_landing("gave_up")

    @property
    def not_landed(self) -> Mapping[NoLanding, int]:
        """How many flights ran out of time for which reason."""
        return self._without_landing("not_landed")

    @property
    def crashes(self) -> Mapping[str, int]:
        """How often the landing system crashed, by kind of crash; without inconclusive flights."""
        counts: Counter[str] = Counter()
        for each in self.flights:
            if each.result.verdict.violation_type == "V":
                kind = each.result.crash.kind if each.result.crash else "ended"
                counts[_CRASHES.get(kind, kind)] += 1
        return counts

    @property
    def inconclusive(self) -> tuple[str, ...]:
        """The slots of the flights that decided nothing."""
        return tuple(each.id.slot_id for each in self.flights if each.result.inconclusive)

    @property
    def types(self) -> Counter[str]:
        """How many flights have which type of violation, built in."""
        return Counter(str(each.violation_type) for each in self.verdicts if each.violation_type)

    @property
    def decided(self) -> Mapping[PropertyName, int]:
        """How many flights decided where and when to land: it held, or it was violated."""
        names: Sequence[PropertyName] = ("distance", "time")
        return {name: count_decided(self.verdicts, name) for name in names}

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
    def causes(self) -> int:
        """How many causes of its kinds are known."""
        return len({kind.cause for kind in self.kinds if kind.case})

    @property
    def effective_kinds(self) -> float:
        """The Hill number of order 1 of the kinds of violation."""
        return hill_number([kind.count for kind in self.kinds], 1)

    @property
    def diversity(self) -> str:
        """How diverse its kinds of violation are; empty for fewer than two."""
        if len(self.kinds) < 2:
            return ""
        causes = counted_causes([kind.cause for kind in self.kinds])
        return (
            f"{len(self.kinds)} kinds of violation{', ' * bool(causes)}{causes}, as diverse as "
            f"{self.effective_kinds:.1f} equally frequent ones"
        )

    @property
    def told(self) -> Mapping[Subject, str]:
        """What it found beside chance, and who decided what in it, by subject."""
        own = any(kind.type == "own" for kind in self.kinds)
        texts: Mapping[Subject, str] = {
            "control": control_text(self.control, has_own=own),
            "origins": origins_text(self.origins, self.model),
            "movers": movers_text(self.movers, self.npcs),
            "director": director_text(self.director),
            "strikes": strikes_text(self.strikes),
            "event director": event_director_text(self.event_director),
        }
        return {subject: text for subject, text in texts.items() if text}

    @property
    def remarks(self) -> tuple[str, ...]:
        """How diverse its kinds are, and all that is reported of it."""
        return tuple(filter(None, (self.diversity, *self.told.values())))

    @property
    def ends(self) -> Counter[str]:
        """How many flights ended how: landed, idle, inconclusive, or the type of the violation."""
        own = {slot for kind in self.kinds if kind.type == "own" for slot in kind.slots}
        return Counter(_end(each, own) for each in self.flights)

    @property
    def kinds_over_flights(self) -> tuple[int, ...]:
        """How many kinds built in the first flights showed, from none to all."""
        seen: set[str] = set()
        counts = [0]
        for each in self.flights:
            if each.result.verdict.violation:
                seen.add(each.signature)
            counts.append(len(seen))
        return tuple(counts)

    @property
    def violations_over_flights(self) -> tuple[int, ...]:
        """How many of the first flights violated a property built in, from none to all."""
        return tuple(itertools.accumulate((v.violation for v in self.verdicts), initial=0))

    def with_cases(self, saved: Sequence[SavedCase], others: Sequence[Case] = ()) -> Self:
        """Return it with the causes that cases tell; kinds of one cause stand together."""
        flights = self.by_slot
        told = [
            kind.with_cases(
                self.key, saved, others, [flights[slot] for slot in kind.slots if slot in flights]
            )
            for kind in self.kinds
        ]
        return dataclasses.replace(self, kinds=tuple(by_cause(told, lambda kind: kind)))

    def _without_landing(self, outcome: str) -> Mapping[NoLanding, int]:
        reasons = Counter(
            _why_no_landing(each.result.verdict)
            for each in self.flights
            if each.result.outcome == outcome
        )
        return {reason: reasons[reason] for reason in WHY_NO_LANDING}

    @property
    def _landed(self) -> list[LedgerFlight]:
        return [each for each in self.flights if each.result.outcome == "landed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """What a run was asked for, and which physics engine and Python flew it.

    None stands for what is not known.
    """

    seed: int | None
    budget: int | None
    method: str | None
    population: int | None
    domain: str | None
    npcs: str | None
    engine: str | None
    python: str | None
    archive: str | None
    """The hash of the archive that it began with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunCosts:
    """The flights of a run beside those of its searches, and the time of its workers."""

    flown_again: int
    """Flown again after a time-out or a kill."""
    beside: int
    """To repeat, confirm, shrink and tell causes apart."""
    twins: int
    """Of these, to tell causes of one ending apart."""
    confirming: int
    """Of these, to confirm and shrink, as far as the session knows that reports them."""
    flights: int
    """Of searches and saved cases."""
    flying_s: float
    idle_s: float

    @property
    def repeating(self) -> int:
        """Of those beside, to see whether violations repeat."""
        return max(0, self.beside - self.confirming - self.twins)

    @property
    def idle_share(self) -> float | None:
        """The share of the workers' time in which they were idle; None if there was no time."""
        all_s = self.flying_s + self.idle_s
        return self.idle_s / all_s if all_s > 0 else None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecord:
    """A run so far: its searches by system, map, domain and tests, its costs and saved cases."""

    ledger: Path
    version: str
    """The version of this package that flew it."""
    options: RunOptions
    began: str | None
    ended: str | None
    """When it ended, in UTC; None while it goes on, and if it was killed."""
    results_sha256: str
    wanted: int
    """Flights of searches, those that have not begun among them."""
    flown: int
    costs: RunCosts
    searches: tuple[SearchRecord, ...]
    names: Mapping[str, str]
    """What texts call each search, by its key in the ledger."""
    cases: tuple[SavedCase, ...]
    """Those of the landing systems that have flights of searches."""
    jobs: Mapping[str, FlightJob]
    """The jobs of the flights above, by the key of their search in the ledger."""

    @property
    def complete(self) -> bool:
        """Whether all was flown and the run came to its end."""
        return self.ended is not None and self.flown == self.wanted

    @property
    def kinds(self) -> tuple[KindRecord, ...]:
        """The kinds of violation of all searches."""
        return tuple(kind for search in self.searches for kind in search.kinds)

    @property
    def findings(self) -> tuple[tuple[SearchRecord, KindRecord], ...]:
        """The findings of all searches, each with its search."""
        return tuple((search, each) for search in self.searches for each in search.findings)

    @property
    def violating(self) -> int:
        """How many flights violate a property, built in or a user's own."""
        return sum(search.violating for search in self.searches)

    @property
    def landed(self) -> int:
        """How many flights landed."""
        return sum(search.landed for search in self.searches)

    @property
    def needless(self) -> int:
        """How many flights did not land although somebody could have."""
        return sum(each.gave_up["needless"] + each.not_landed["needless"] for each in self.searches)

    @property
    def crashes(self) -> int:
        """How often a landing system crashed."""
        return sum(sum(search.crashes.values()) for search in self.searches)

    @property
    def types_by_phase(self) -> Mapping[str, Counter[str]]:
        """How many flights have which type of violation, by the phase in which it begins."""
        counts: dict[str, Counter[str]] = {}
        for kind in self.kinds:
            counts.setdefault(kind.type, Counter())[kind.phase] += kind.count
        return counts


def _why_no_landing(verdict: Verdict) -> NoLanding:
    """Return why a flight did not land.

    One that never gave up where nobody could have landed violates something, so its verdict has no
    excuse; but it was not needless that it did not land.
    """
    if verdict.cause != NEVER_GAVE_UP:
        return verdict.no_landing
    return "blocked" if _BLOCKED in verdict.story else "excused"


def _end(flight: LedgerFlight, own: Set[str]) -> str:
    """Return how a flight ended, given the slots of failed assertions of a user's own."""
    if flight.result.inconclusive:
        return INCONCLUSIVE
    if flight.result.verdict.violation_type:
        return flight.result.verdict.violation_type
    if flight.id.slot_id in own:
        return "own"
    return LANDED if flight.result.outcome in ("landed", "held") else IDLE


def by_cause(shown: Iterable[T], kind_of: Callable[[T], KindRecord]) -> list[T]:
    """Return what shows kinds, those of one cause together, the most frequent cause first.

    A kind of which nobody knows the cause stands for itself.  The order within a cause is kept, and
    so is that of causes which are equally frequent.
    """
    groups: dict[tuple[str, ...], list[T]] = {}
    for number, each in enumerate(shown):
        cause = kind_of(each).cause
        groups.setdefault(("", str(number)) if cause is None else cause, []).append(each)
    ordered = sorted(groups.values(), key=lambda group: -sum(kind_of(e).count for e in group))
    return [each for group in ordered for each in group]


def _order_of(case: Case, flight: int | None) -> tuple[bool, bool, int, int]:
    """Return the place of a case among those of its kind; ``flight`` is where it was found."""
    if flight is None:
        return True, False, 0, 0
    conditions = len(case.severity.acting)
    return False, not conditions, conditions, flight


def place_of(case: Case) -> tuple[str, str, str]:
    """Return where a case shows which ending: its system, its map, how it ends."""
    return case.system, case.scenario.map, case.ending
