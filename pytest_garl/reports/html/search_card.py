"""A landing system on a map in the index: how its flights ended; what the run cost, its domain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pytest_garl.reports.html.charts import Segment, outcome_bar
from pytest_garl.reports.html.kind_page import Fact
from pytest_garl.reports.search_summary import WHY_NO_LANDING, SearchSummary
from pytest_garl.reports.shares_text import PAPER_DEFINITION, kinds_lines, limits_text, percent
from pytest_garl.verdicts.statistics import share_interval


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchCard:
    """A landing system on a map: how its flights ended, and its figures."""

    name: str
    map: str
    flown: int
    wanted: int
    bar: tuple[Segment, ...]
    violating: str
    figures: tuple[Fact, ...]
    kinds_text: tuple[str, ...]


def search_card(search: SearchSummary, wanted: int) -> SearchCard:
    """Return how the flights of a search ended; ``wanted`` is how many it shall have."""
    total = len(search.flights)
    low, high = share_interval(search.violating, total)
    gave_up, not_landed = (search.without_landing(each) for each in ("gave_up", "not_landed"))
    figures = [
        ("landed", _of(search.count("landed"), total)),
        (PAPER_DEFINITION, _of(search.violating_by_the_paper, total)),
        ("gave up", ", ".join(f"{why} {gave_up[why]}" for why in WHY_NO_LANDING)),
        ("ran out of time", ", ".join(f"{why} {not_landed[why]}" for why in WHY_NO_LANDING)),
        ("crashed", ", ".join(f"{kind} {count}" for kind, count in search.crashes.items())),
        ("inconclusive", str(search.count("inconclusive") or "")),
    ]
    distance_m, time_s = search.landing_distance_m, search.landing_time_s
    if distance_m and time_s:
        figures += [
            (
                "distance from the marker",
                f"median {distance_m.median:.2f} m, worst {distance_m.worst:.2f} m",
            ),
            ("time to the touchdown", f"median {time_s.median:.1f} s, worst {time_s.worst:.1f} s"),
        ]
    return SearchCard(
        name=search.name,
        map=search.map,
        flown=total,
        wanted=wanted,
        bar=outcome_bar(search),
        violating=(
            f"{percent(search.violating, total)} violate something "
            f"(95 %: {100 * low:.1f} to {100 * high:.1f} %)"
        ),
        figures=tuple(figure for figure in figures if figure[1]),
        kinds_text=tuple(kinds_lines(search)),
    )


def _of(count: int, total: int) -> str:
    return f"{count} ({percent(count, total)})"


def cost_rows(found: Mapping[str, Any]) -> tuple[Fact, ...]:
    """Return what a run cost, from its report as data."""
    flights, time = found["flights"], found["time"]
    flying_s, idle_s = time["flying_s"], time["idle_s"]
    in_all = flights["flown"] + flights["beside"]
    return (
        ("flights of the search", f"{flights['flown']} of {flights['wanted']}"),
        ("flights to repeat, confirm, shrink and tell causes apart", str(flights["beside"])),
        ("flown again after a time-out or a kill", str(flights["flown_again"])),
        ("time that workers spent on all flights", _duration(flying_s)),
        ("a flight on average", f"{flying_s / in_all:.1f} s" if in_all and flying_s else ""),
        (
            "workers idle",
            f"{100 * idle_s / (flying_s + idle_s):.0f} %" if flying_s + idle_s else "",
        ),
        ("began", _utc(time["began"])),
        ("ended", _utc(time["ended"])),
    )


def _utc(text: object) -> str:
    return f"{str(text)[:19].replace('T', ' ')} UTC" if text else ""


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def domain_rows(searches: Sequence[SearchSummary], found: Mapping[str, Any]) -> tuple[Fact, ...]:
    """Return domain, NPC policy and limits of the searches; those that share them in one row."""
    rows: dict[str, list[str]] = {}
    for search in searches:
        domains = " and ".join(search.domains) or str(found["run"]["domain"] or "")
        limits = "; ".join(limits_text(each) for each in search.limits)
        text = f"domain {domains}, NPCs {' and '.join(search.npcs)}; limits {limits}"
        rows.setdefault(text, []).append(f"{search.name} on {search.map}")
    if len(rows) == 1:
        return tuple(("all flights", text) for text in rows)
    return tuple((", ".join(names), text) for text, names in rows.items())
