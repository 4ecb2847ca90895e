"""The violations of a search by signature, for the terminal, GitHub and ``garl report``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.verdicts.verdict import Verdict
from pytest_garl.verdicts.wording import headline


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
    """All violations with one signature.

    ``count`` is the number of flights, ``first`` the slot of the first one, ``story`` what happened
    in it, and ``headline`` the story in short.
    """

    signature: str
    count: int
    first: str
    story: str
    headline: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSummary:
    """All flights of a system on a map, and their kinds of violation, the most frequent first."""

    system: str
    map: str
    files: tuple[str, ...]
    """The test files of the system."""
    flights: tuple[LedgerFlight, ...]
    kinds: tuple[ViolationKind, ...]
    violating: int
    """How many flights violate a property, built in or a user's own."""

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
    return [
        _summary(ledger, system, map, flights, failures.get((system, map), []))
        for (system, map), flights in flown.items()
    ]


def _summary(
    ledger: Ledger,
    system: str,
    map: str,
    flights: list[LedgerFlight],
    user_failures: list[SlotUserFailure],
) -> SearchSummary:
    # (slot, story) of all violations, by signature.
    violations: dict[str, list[tuple[str, str]]] = {}
    for flight in flights:
        verdict = flight.result.verdict
        if verdict.violation:
            violation = flight.id.slot_id, verdict.story
            violations.setdefault(verdict.signature, []).append(violation)
    for each in sorted(user_failures, key=lambda each: each.slot):
        violations.setdefault(each.signature, []).append((each.slot, each.message))
    kinds = [
        ViolationKind(
            signature=signature,
            count=len({slot for slot, _ in items}),
            first=items[0][0],
            story=items[0][1],
            headline=headline(items[0][1]),
        )
        for signature, items in violations.items()
    ]
    files = str(ledger.fact(f"files of {system} on {map}") or "")
    return SearchSummary(
        system=system,
        map=map,
        files=tuple(files.split()),
        flights=tuple(flights),
        kinds=tuple(sorted(kinds, key=lambda each: (-each.count, each.signature))),
        violating=len({slot for items in violations.values() for slot, _ in items}),
    )


LEGEND = {
    "I": "landed on something else",
    "I?": "landed elsewhere, unknown on what",
    "II": "not landed, marker not seen",
    "III": "hit a fixed body",
    "IV": "hit a moving body",
    "V": "Python error, death or hang of the landing system",
    "late": "not landed in time",
    "off": "landed off its own right target",
    "hard": "touched down too fast or tilted",
    "abort": "gave up",
    "own": "an assertion of a test",
}
"""Meanings of the types: the part of a signature before the first colon."""


def legend(kinds: Iterable[ViolationKind]) -> str:
    """Return the meanings of the types of these kinds, in one line."""
    types = {kind.signature.partition(":")[0] for kind in kinds}
    return "; ".join(f"{name}: {meaning}" for name, meaning in LEGEND.items() if name in types)
