"""Two runs side by side: how their flights ended, and which kinds of violation came and went."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from pytest_garl.execution.facts import SearchKey
from pytest_garl.messages import printable
from pytest_garl.reports.run_record import (
    WHY_NO_LANDING,
    KindRecord,
    RunRecord,
    SearchRecord,
    Spread,
)
from pytest_garl.reports.run_text import percent

SCHEMA = "pytest-garl-comparison"
VERSION = 1
Pair = tuple[SearchRecord | None, SearchRecord | None]
"""A search in the earlier run and in the later one."""
NOTHING = "–"


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """A value of the earlier run beside that of the later one, in words."""

    name: str
    before: str
    after: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KindChange:
    """A kind of violation in two runs, by its numbers of flights.

    ``by_chance`` is the probability that the run without the kind would show none of it if its
    flights had it as often as the other's, independently; None for a kind of both runs.
    """

    signature: str
    headline: str
    before: int
    after: int
    by_chance: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchComparison:
    """One search in two runs; a run without it has 0 flights."""

    name: str
    system: str
    map: str
    flown: tuple[int, int]
    sides: tuple[Side, ...]
    gained: tuple[KindChange, ...]
    lost: tuple[KindChange, ...]
    kept: tuple[KindChange, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunComparison:
    """Two runs: ``unlike`` are the facts in which they differ beside their landing systems."""

    before: str
    after: str
    unlike: tuple[Side, ...]
    searches: tuple[SearchComparison, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as values for JSON; system and map tell most searches apart."""
        found = dataclasses.asdict(self)
        for each in found["searches"]:
            if each["name"] == SearchKey(system=each["system"], map=each["map"]).place:
                del each["name"]
        return {"schema": SCHEMA, "version": VERSION, **found}


def compare_runs(before: RunRecord, after: RunRecord) -> RunComparison:
    """Compare an earlier run with a later one."""
    return RunComparison(
        before=str(before.ledger),
        after=str(after.ledger),
        unlike=tuple(_unlike(before, after)),
        searches=tuple(_search(pair) for pair in _pairs(before, after)),
    )


def _pairs(before: RunRecord, after: RunRecord) -> list[Pair]:
    """Return the searches side by side.

    If each run has one search of a landing system on a map, these are a pair, also if their domains
    differ.  Otherwise two searches of the same domain and tests are a pair.
    """
    both = before.searches, after.searches
    by_place: dict[tuple[str, str], tuple[list[SearchRecord], list[SearchRecord]]] = {}
    for side, searches in enumerate(both):
        for each in searches:
            place = by_place.setdefault((each.key.system, each.key.map), ([], []))
            place[side].append(each)
    pairs: list[Pair] = []
    for first, second in by_place.values():
        if max(len(first), len(second)) == 1:
            pairs.append((next(iter(first), None), next(iter(second), None)))
            continue
        found = [{each.key: each for each in side} for side in (first, second)]
        keys = dict.fromkeys(key for side in found for key in side)
        pairs += [(found[0].get(key), found[1].get(key)) for key in keys]
    return pairs


def _unlike(before: RunRecord, after: RunRecord) -> Iterable[Side]:
    facts = [
        {
            # What decides what its flights meet.
            "method": run.options.method,
            "budget": run.options.budget,
            "seed": run.options.seed,
            "domain": run.options.domain,
            "npcs": run.options.npcs,
            "archive": run.options.archive or "none",
            "pytest-garl": run.version,
            "finished": "yes" if run.complete else "no",
        }
        for run in (before, after)
    ]
    for name, value in facts[0].items():
        if value != facts[1][name]:
            yield Side(name=name, before=str(value), after=str(facts[1][name]))


def _search(pair: Pair) -> SearchComparison:
    """Compare a pair, which has its name in the later run if both runs flew it."""
    before, after = pair
    last = next(each for each in reversed(pair) if each is not None)
    counts = [{kind.signature: kind for kind in each.kinds} if each else {} for each in pair]
    flown = (before.flown if before else 0, after.flown if after else 0)
    signatures = sorted(dict.fromkeys((*counts[0], *counts[1])))
    changes = [
        _change(each, counts[0].get(each), counts[1].get(each), flown) for each in signatures
    ]
    changes.sort(key=lambda change: -(change.before + change.after))
    both = before is not None and after is not None
    return SearchComparison(
        name=last.name,
        system=last.key.system,
        map=last.key.map,
        flown=flown,
        sides=tuple(
            Side(name=title, before=one, after=other)
            for title, one, other in zip(_FIGURES, _figures(before), _figures(after), strict=True)
        ),
        gained=tuple(each for each in changes if both and not each.before),
        lost=tuple(each for each in changes if both and not each.after),
        kept=tuple(each for each in changes if not both or (each.before and each.after)),
    )


def _change(
    signature: str, before: KindRecord | None, after: KindRecord | None, flown: tuple[int, int]
) -> KindChange:
    counts = (before.count if before else 0, after.count if after else 0)
    by_chance = None
    if all(flown) and not all(counts):
        seen, unseen = (0, 1) if counts[0] else (1, 0)
        by_chance = (1 - counts[seen] / flown[seen]) ** flown[unseen]
    known = after or before
    return KindChange(
        signature=signature,
        headline=known.headline if known else "",
        before=counts[0],
        after=counts[1],
        by_chance=by_chance,
    )


_FIGURES = (
    "flights",
    "landed",
    *(f"gave up, {why}" for why in WHY_NO_LANDING),
    "not landed",
    "violate something",
    "software crashes",
    "kinds of violation",
    "effective kinds",
    "median distance of landings",
    "median time of landings",
)


def _figures(search: SearchRecord | None) -> list[str]:
    """Return the figures of a search in words, in the order of their names; else dashes."""
    if search is None:
        return [NOTHING] * len(_FIGURES)
    counts = [
        search.landed,
        *(search.gave_up[why] for why in WHY_NO_LANDING),
        sum(search.not_landed.values()),
        search.violating,
        sum(search.crashes.values()),
    ]
    return [
        str(search.flown),
        *(percent(count, search.flown) for count in counts),
        str(len(search.kinds)),
        f"{search.effective_kinds:.1f}",
        _median(search.landing_distance_m, "m", 2),
        _median(search.landing_time_s, "s", 1),
    ]


def _median(spread: Spread | None, unit: str, digits: int) -> str:
    return f"{spread.median:.{digits}f} {unit}" if spread else NOTHING


def change_text(change: KindChange, flown: tuple[int, int]) -> str:
    """Return the numbers of a kind's flights, and whether chance may explain a gain or loss."""
    counts = f"{change.before} of {flown[0]} -> {change.after} of {flown[1]}"
    if change.by_chance is None:
        return counts
    return f"{counts}, by chance with {_probability(change.by_chance)}"


def _probability(value: float) -> str:
    return f"{100 * value:.0f} %" if value >= 0.01 else "less than 1 %"


def comparison_text(found: RunComparison) -> str:
    """Return a comparison for the terminal."""
    lines = [f"before: {found.before}", f"after:  {found.after}"]
    lines += [f"not alike: {each.name} {each.before} -> {each.after}" for each in found.unlike]
    for search in found.searches:
        lines += ["", search.name, *_table(search)]
        for title, changes in _titled(search):
            lines.append(f"  {title}:")
            for change in changes:
                lines.append(f"    {change.signature}: {change_text(change, search.flown)}")
                lines.append(f"        {change.headline}")
    if not found.searches:
        return "no flights yet\n"
    return "".join(f"{printable(line, keep='')}\n" for line in lines)


def _titled(search: SearchComparison) -> Iterable[tuple[str, tuple[KindChange, ...]]]:
    titled = (
        ("gained kinds", search.gained),
        ("lost kinds", search.lost),
        ("kinds in both" if all(search.flown) else "kinds", search.kept),
    )
    return ((title, changes) for title, changes in titled if changes)


def _table(search: SearchComparison) -> list[str]:
    rows = [("", "before", "after"), *((s.name, s.before, s.after) for s in search.sides)]
    first, second, third = (max(len(row[i]) for row in rows) for i in range(3))
    return [f"  {a:<{first}}  {b:>{second}}  {c:>{third}}" for a, b, c in rows]
