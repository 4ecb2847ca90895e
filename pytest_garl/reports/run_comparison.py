"""Two runs side by side: how their flights ended, and which kinds of violation came and went."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pytest_garl.messages import printable
from pytest_garl.reports.search_summary import WHY_NO_LANDING
from pytest_garl.reports.shares_text import percent

SCHEMA = "pytest-garl-comparison"
VERSION = 1
Report = Mapping[str, Any]
"""A run as ``run_report`` returns it."""
_ALIKE = ("method", "budget", "seed", "domain", "npcs")
"""Facts of a run that decide what its flights meet."""
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
    """One landing system on one map in two runs; a run without it has 0 flights."""

    system: str
    map: str
    flown: tuple[int, int]
    sides: tuple[Side, ...]
    gained: tuple[KindChange, ...]
    lost: tuple[KindChange, ...]
    kept: tuple[KindChange, ...]

    @property
    def name(self) -> str:
        """The name of the landing system's class, and the map."""
        return f"{self.system.split(':')[-1]} on {self.map}"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunComparison:
    """Two runs: ``unlike`` are the facts in which they differ beside their landing systems."""

    before: str
    after: str
    unlike: tuple[Side, ...]
    searches: tuple[SearchComparison, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as values for JSON."""
        return {"schema": SCHEMA, "version": VERSION, **dataclasses.asdict(self)}


def compare_runs(before: Report, after: Report) -> RunComparison:
    """Compare an earlier run with a later one, both as ``run_report`` returns them."""
    of = [
        {(each["system"], each["map"]): each for each in report["searches"]}
        for report in (before, after)
    ]
    keys = dict.fromkeys(key for searches in of for key in searches)
    return RunComparison(
        before=before["ledger"],
        after=after["ledger"],
        unlike=tuple(_unlike(before, after)),
        searches=tuple(_search(key, of[0].get(key), of[1].get(key)) for key in keys),
    )


def _unlike(before: Report, after: Report) -> Iterable[Side]:
    facts = [
        {
            **{key: report["run"][key] for key in _ALIKE},
            "pytest-garl": report["pytest_garl"],
            "finished": "yes" if report["complete"] else "no",
        }
        for report in (before, after)
    ]
    for name, value in facts[0].items():
        if value != facts[1][name]:
            yield Side(name=name, before=str(value), after=str(facts[1][name]))


def _search(
    key: tuple[str, str], before: Mapping[str, Any] | None, after: Mapping[str, Any] | None
) -> SearchComparison:
    counts = [
        {kind["signature"]: kind for kind in (each or {"signatures": ()})["signatures"]}
        for each in (before, after)
    ]
    flown = (before["flown"] if before else 0, after["flown"] if after else 0)
    signatures = sorted(dict.fromkeys((*counts[0], *counts[1])))
    changes = [
        _change(each, counts[0].get(each), counts[1].get(each), flown) for each in signatures
    ]
    changes.sort(key=lambda change: -(change.before + change.after))
    both = before is not None and after is not None
    return SearchComparison(
        system=key[0],
        map=key[1],
        flown=flown,
        sides=tuple(
            Side(name=name, before=one, after=other)
            for (name, one), (_, other) in zip(_figures(before), _figures(after), strict=True)
        ),
        gained=tuple(each for each in changes if both and not each.before),
        lost=tuple(each for each in changes if both and not each.after),
        kept=tuple(each for each in changes if not both or (each.before and each.after)),
    )


def _change(
    signature: str,
    before: Mapping[str, Any] | None,
    after: Mapping[str, Any] | None,
    flown: tuple[int, int],
) -> KindChange:
    counts = (before["count"] if before else 0, after["count"] if after else 0)
    by_chance = None
    if all(flown) and not all(counts):
        seen, unseen = (0, 1) if counts[0] else (1, 0)
        by_chance = (1 - counts[seen] / flown[seen]) ** flown[unseen]
    return KindChange(
        signature=signature,
        headline=(after or before or {})["headline"],
        before=counts[0],
        after=counts[1],
        by_chance=by_chance,
    )


def _figures(search: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Return the figures of a search in words, each with its name; dashes for a run without it."""
    found = search or {}
    flown = int(found.get("flown", 0))

    def share(count: int) -> str:
        return percent(count, flown) if flown else NOTHING

    def spread(name: str, unit: str, digits: int) -> str:
        value = found.get(name)
        return f"{value['median']:.{digits}f} {unit}" if value else NOTHING

    gave_up = found.get("gave_up", {})
    return [
        ("flights", str(flown) if search else NOTHING),
        ("landed", share(found.get("landed", 0))),
        *((f"gave up, {why}", share(gave_up.get(why, 0))) for why in WHY_NO_LANDING),
        ("not landed", share(sum(found.get("not_landed", {}).values()))),
        ("violate something", share(found.get("violating", 0))),
        ("software crashes", share(sum(found.get("crashes", {}).values()))),
        ("kinds of violation", str(len(found["signatures"])) if search else NOTHING),
        ("effective kinds", f"{found['effective_kinds']:.1f}" if search else NOTHING),
        ("median distance of landings", spread("landing_distance_m", "m", 2)),
        ("median time of landings", spread("landing_time_s", "s", 1)),
    ]


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
