"""The index of a report: the run in one look, as plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.reports.causes import counted_causes
from pytest_garl.reports.html.charts import (
    Plot,
    kinds_over_flights,
    violations_over_flights,
)
from pytest_garl.reports.html.flight_task import ShownFlight
from pytest_garl.reports.html.kind_page import Fact, KindPage, KindPlan
from pytest_garl.reports.html.naming import page_address, shown_file, still_address
from pytest_garl.reports.html.search_card import SearchCard, cost_rows, domain_rows, search_card
from pytest_garl.reports.search_summary import LEGEND, SearchSummary, by_cause
from pytest_garl.reports.shares_text import in_control_text, kinds_lines, percent

PHASES = ("take-off", "transit", "search", "approach", "descent", "last-metre", "standing")
"""Phases of a landing (``verdicts/evidence.py``), in its order."""
NO_PHASE = "not of a phase"
MOST_THUMBNAILS = 24
"""So that the index stays below 300 kB: a small picture takes some 6 kB."""
MOST_FINDINGS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class KindRow:
    """A kind of violation in the index, with the addresses of its page and its picture's file.

    ``still`` is empty if there is no picture.
    """

    address: str
    still: str
    title: str
    ending: str
    signature: str
    where: str
    count: int
    flown: int
    facts: tuple[str, ...]
    tag: str
    thumbnail: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ArchiveRow:
    """Flights of one type of violation by phase: (number, shade from 0 to 4)."""

    type: str
    meaning: str
    cells: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPage:
    """What the index says; ``problem`` says that a run is not finished."""

    title: str
    subtitle: str
    problem: str
    numbers: tuple[Fact, ...]
    searches: tuple[SearchCard, ...]
    kinds: tuple[KindRow, ...]
    not_by_chance: tuple[KindRow, ...]
    compared: bool
    """Whether random flights of any kind were counted beside the later ones."""
    control: tuple[Fact, ...]
    kinds_plot: Plot | None
    violations_plot: Plot | None
    phases: tuple[str, ...]
    archive: tuple[ArchiveRow, ...]
    findings: tuple[tuple[str, str, int, str], ...]
    cost: tuple[Fact, ...]
    domain: tuple[Fact, ...]
    cases: tuple[tuple[str, str, str, str], ...]
    origin: tuple[Fact, ...]
    notes: tuple[str, ...]


def run_page(
    found: Mapping[str, Any],
    searches: Sequence[SearchSummary],
    shown: Sequence[tuple[KindPlan, KindPage]],
    missing: Sequence[str],
) -> RunPage:
    """Return the index of a run: ``found`` is its report as data, ``shown`` its pages in order."""
    # Over all searches, frequent ones first.
    shown = by_cause(sorted(shown, key=_order), lambda each: each[0].kind)
    kinds = [_kind(plan, page, index) for index, (plan, page) in enumerate(shown)]
    flights = found["flights"]
    violating = sum(each.violating for each in searches)
    not_by_chance = {page.name for plan, page in shown if plan.kind.in_control == 0}
    return RunPage(
        title=_title(searches, len(kinds), violating),
        subtitle=_subtitle(found),
        problem=_problem(found),
        numbers=_numbers(searches, flights["flown"], violating, len(kinds)),
        searches=tuple(
            search_card(search, row["wanted"])
            for search, row in zip(searches, found["searches"], strict=True)
        ),
        kinds=tuple(kinds),
        not_by_chance=tuple(row for row in kinds if Path(row.address).stem in not_by_chance),
        compared=any(plan.kind.in_control is not None for plan, _ in shown),
        control=tuple(
            (f"{each.name} on {each.map}", text) for each in searches for text in kinds_lines(each)
        ),
        kinds_plot=kinds_over_flights(searches),
        violations_plot=violations_over_flights(searches),
        phases=(*PHASES, NO_PHASE),
        archive=_archive(searches),
        findings=tuple(
            (each.signature, f"{search.name} on {search.map}", each.count, each.headline)
            for search in searches
            for each in search.findings
        )[:MOST_FINDINGS],
        cost=cost_rows(found),
        domain=domain_rows(searches, found),
        cases=tuple(
            (
                _file(case["file"]),
                case["signature"],
                case["status"],
                "yes" if case["known"] else "no",
            )
            for case in found["cases"]
        ),
        origin=_origin(found),
        notes=tuple(missing),
    )


def _title(searches: Sequence[SearchSummary], kinds: int, violating: int) -> str:
    flown = sum(len(each.flights) for each in searches)
    if not flown:
        return "No flights yet"
    names = list(dict.fromkeys(each.name for each in searches))
    who = names[0] if len(names) == 1 else f"{len(names)} landing systems"
    if not violating:
        return f"{who}: no violation in {flown} flights"
    ways = "one way" if kinds == 1 else f"{kinds} ways"
    causes = counted_causes([kind.case for each in searches for kind in each.kinds])
    with_causes = f", {causes}" if causes else ""
    return f"{who}: {violating} of {flown} flights violate something, in {ways}{with_causes}"


def _order(shown: tuple[KindPlan, KindPage]) -> tuple[int, str, str]:
    plan, page = shown
    return -plan.kind.count, plan.kind.signature, page.where


def _subtitle(found: Mapping[str, Any]) -> str:
    run, began = found["run"], str(found["time"]["began"] or "")
    day = f"{began[:16].replace('T', ' ')} UTC, " if began else ""
    return (
        f"{day}method {run['method']}, budget {run['budget']} per system and map, "
        f"seed {run['seed']}"
    )


def _problem(found: Mapping[str, Any]) -> str:
    if found["complete"]:
        return ""
    flights = found["flights"]
    if flights["flown"] < flights["wanted"]:
        return (
            f"This run is not finished: {flights['flown']} of {flights['wanted']} flights. The "
            "same pytest command with --garl-resume goes on."
        )
    return (
        "All flights are flown, but pytest has not come to its end: cases may be missing. The same "
        "pytest command with --garl-resume goes on."
    )


def _numbers(
    searches: Sequence[SearchSummary], flown: int, violating: int, kinds: int
) -> tuple[Fact, ...]:
    landed = sum(each.count("landed") for each in searches)
    needless = sum(
        each.without_landing(outcome)["needless"]
        for each in searches
        for outcome in ("gave_up", "not_landed")
    )
    crashes = sum(sum(each.crashes.values()) for each in searches)
    return (
        ("flights", str(flown)),
        ("landed", _share(landed, flown)),
        ("violate something", _share(violating, flown)),
        ("did not land, needlessly", _share(needless, flown)),
        ("software crashes", str(crashes)),
        ("kinds of violation", str(kinds)),
    )


def _share(count: int, total: int) -> str:
    return percent(count, total) if total else "–"


def _kind(plan: KindPlan, page: KindPage, index: int) -> KindRow:
    kind, search = plan.kind, plan.search
    case = plan.case
    facts = [
        kind.least,
        in_control_text(kind.in_control, search.random_flights),
        case.robustness if case else "",
        case.prevention.text.partition(":")[0] if case else "",
    ]
    tag = "saved case" if case else ""
    if case and case.reason:
        tag = f"{tag}, gates nothing: {case.reason}"
    return KindRow(
        address=page_address(plan.name),
        still=still_address(plan.name) if page.flight.stills else "",
        title=page.title,
        ending=page.ending,
        signature=kind.signature,
        where=page.where,
        count=kind.count,
        flown=len(search.flights),
        facts=tuple(fact for fact in facts if fact),
        tag=tag,
        thumbnail=_thumbnail(page.flight, index),
    )


def _thumbnail(flight: ShownFlight, index: int) -> str:
    return flight.thumbnail if index < MOST_THUMBNAILS else ""


def _archive(searches: Sequence[SearchSummary]) -> tuple[ArchiveRow, ...]:
    counts: dict[str, dict[str, int]] = {}
    for search in searches:
        for kind in search.kinds:
            parts = kind.signature.split(":")
            phase = next((part for part in parts[1:] if part in PHASES), NO_PHASE)
            row = counts.setdefault(parts[0], {})
            row[phase] = row.get(phase, 0) + kind.count
    most = max((count for row in counts.values() for count in row.values()), default=1)
    return tuple(
        ArchiveRow(
            type=name,
            meaning=LEGEND[name],
            cells=tuple(
                (count := counts[name].get(phase, 0), _shade(count, most))
                for phase in (*PHASES, NO_PHASE)
            ),
        )
        for name in LEGEND
        if name in counts
    )


def _shade(count: int, most: int) -> int:
    return 0 if not count else min(4, 1 + int(4 * count / (most + 1)))


def _origin(found: Mapping[str, Any]) -> tuple[Fact, ...]:
    ledger = Path(found["ledger"])
    return (
        ("results, SHA-256", found["results_sha256"]),
        ("pytest-garl", str(found["pytest_garl"])),
        ("Python", str(found["run"]["python"] or "")),
        ("ledger", f"{ledger.absolute().parent.name}/{ledger.name}"),
    )


def _file(path: str) -> str:
    return shown_file(Path(path))
