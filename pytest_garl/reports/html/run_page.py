"""The index of a report: the run in one look. Its template asks this module for texts and rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pytest_garl.reports.html.kind_page import Fact, KindPage, KindPlan, tag_of
from pytest_garl.reports.html.naming import still_address
from pytest_garl.reports.run_record import (
    PHASES,
    KindRecord,
    RunRecord,
    SearchRecord,
    by_cause,
)
from pytest_garl.reports.run_text import (
    LEGEND,
    PAPER_DEFINITION,
    counts_text,
    percent,
)
from pytest_garl.reports.sentences import counted_causes
from pytest_garl.verdicts.wording import limits_text

MOST_THUMBNAILS = 24
"""So that the index stays below 300 kB: a small picture takes some 6 kB."""
MOST_FINDINGS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class KindRow:
    """A kind of violation in the index, with its page and the address of its picture's file.

    ``still`` is empty if there is no picture.
    """

    kind: KindRecord
    page: KindPage
    flown: int
    still: str
    facts: tuple[str, ...]
    tag: str
    thumbnail: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPage:
    """What the index shows: a run, the rows of its kinds, and what is missing in the report."""

    run: RunRecord
    kinds: tuple[KindRow, ...]
    notes: tuple[str, ...]


def run_page(
    run: RunRecord, shown: Sequence[tuple[KindPlan, KindPage]], missing: Sequence[str]
) -> RunPage:
    """Return the index of a run; ``shown`` are its pages in order."""
    # Over all searches, frequent ones first.
    shown = by_cause(sorted(shown, key=_order), lambda each: each[0].kind)
    kinds = tuple(_kind(plan, page, index) for index, (plan, page) in enumerate(shown))
    return RunPage(run=run, kinds=kinds, notes=tuple(missing))


def title(run: RunRecord) -> str:
    """Return who was flown, and how many flights violate something in how many ways."""
    if not run.flown:
        return "No flights yet"
    names = list(dict.fromkeys(each.key.class_name for each in run.searches))
    who = names[0] if len(names) == 1 else f"{len(names)} landing systems"
    if not run.violating:
        return f"{who}: no violation in {run.flown} flights"
    ways = "one way" if len(run.kinds) == 1 else f"{len(run.kinds)} ways"
    causes = counted_causes([kind.cause for kind in run.kinds])
    with_causes = f", {causes}" if causes else ""
    return (
        f"{who}: {run.violating} of {run.flown} flights violate something, in {ways}{with_causes}"
    )


def _order(shown: tuple[KindPlan, KindPage]) -> tuple[int, str, str]:
    plan, page = shown
    return -plan.kind.count, plan.kind.signature, page.where


def subtitle(run: RunRecord) -> str:
    """Return when the run began, and what it was asked for."""
    day = f"{run.began[:16].replace('T', ' ')} UTC, " if run.began else ""
    options = run.options
    return (
        f"{day}method {options.method}, budget {options.budget} per system and map, "
        f"seed {options.seed}"
    )


def problem(run: RunRecord) -> str:
    """Return that a run is not finished; empty if it is."""
    if run.complete:
        return ""
    if run.flown < run.wanted:
        return (
            f"This run is not finished: {run.flown} of {run.wanted} flights. The "
            "same pytest command with --garl-resume goes on."
        )
    return (
        "All flights are flown, but pytest has not come to its end: cases may be missing. The same "
        "pytest command with --garl-resume goes on."
    )


def numbers(run: RunRecord) -> tuple[Fact, ...]:
    """Return the figures at the top."""
    return (
        ("flights", str(run.flown)),
        ("landed", _share(run.landed, run.flown)),
        ("violate something", _share(run.violating, run.flown)),
        ("did not land, needlessly", _share(run.needless, run.flown)),
        ("software crashes", str(run.crashes)),
        ("kinds of violation", str(len(run.kinds))),
    )


def _share(count: int, total: int) -> str:
    return percent(count, total) if total else "–"


def violating_text(search: SearchRecord) -> str:
    """Return the share of flights that violate something, with its interval."""
    total = search.flown
    share = percent(search.violating, total)
    low, high = (percent(total * each, total, sign="") for each in search.violating_interval)
    return f"{share} violate something (95 %: {low} to {high} %)"


def figures(search: SearchRecord) -> list[Fact]:
    """Return how the flights of a search ended."""
    total = search.flown
    found = [
        ("landed", _of(search.landed, total)),
        (PAPER_DEFINITION, _of(search.violating_by_the_paper, total)),
        ("gave up", counts_text(search.gave_up)),
        ("ran out of time", counts_text(search.not_landed)),
        ("crashed", counts_text(search.crashes)),
        ("inconclusive", str(len(search.inconclusive) or "")),
    ]
    distance_m, time_s = search.landing_distance_m, search.landing_time_s
    if distance_m and time_s:
        found += [
            (
                "distance from the marker",
                f"median {distance_m.median:.2f} m, worst {distance_m.worst:.2f} m",
            ),
            ("time to the touchdown", f"median {time_s.median:.1f} s, worst {time_s.worst:.1f} s"),
        ]
    told, model = search.told, search.model
    if model is not None:
        mean = f"{model.error_of_mean:.2f} by the mean of earlier flights"
        found.append(("error of the model's margins", f"{model.error:.2f} of a safe one, {mean}"))
    found += [
        ("NPCs", told.get("movers", "")),
        ("how good the director of NPCs was", told.get("director", "")),
        ("events", told.get("strikes", "")),
        ("how good the director of events was", told.get("event director", "")),
    ]
    return [figure for figure in found if figure[1]]


def _of(count: int, total: int) -> str:
    return f"{count} ({percent(count, total)})"


def cost_rows(run: RunRecord) -> tuple[Fact, ...]:
    """Return what a run cost."""
    costs, in_all, idle = run.costs, run.flown + run.costs.beside, run.costs.idle_share
    flying_s = costs.flying_s
    return (
        ("flights of the search", f"{run.flown} of {run.wanted}"),
        ("flights to repeat, confirm, shrink and tell causes apart", str(costs.beside)),
        ("flown again after a time-out or a kill", str(costs.flown_again)),
        ("time that workers spent on all flights", _duration(flying_s)),
        ("a flight on average", f"{flying_s / in_all:.1f} s" if in_all and flying_s else ""),
        ("workers idle", "" if idle is None else f"{100 * idle:.0f} %"),
        ("began", _utc(run.began)),
        ("ended", _utc(run.ended)),
    )


def _utc(text: str | None) -> str:
    return f"{text[:19].replace('T', ' ')} UTC" if text else ""


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def domain_rows(run: RunRecord) -> tuple[Fact, ...]:
    """Return domain, NPC policy and limits of the searches; those that share them in one row."""
    rows: dict[str, list[str]] = {}
    for search in run.searches:
        domain = search.key.domain or str(run.options.domain or "")
        limits = "; ".join(limits_text(each) for each in search.limits)
        text = f"domain {domain}, NPCs {' and '.join(search.npcs)}; limits {limits}"
        rows.setdefault(text, []).append(search.name)
    if len(rows) == 1:
        return tuple(("all flights", text) for text in rows)
    return tuple((", ".join(names), text) for text, names in rows.items())


def _kind(plan: KindPlan, page: KindPage, index: int) -> KindRow:
    kind, search, case = plan.kind, plan.search, plan.case
    facts = [
        kind.least,
        kind.seen_in_control,
        case.robustness if case else "",
        case.prevention.text.partition(":")[0] if case else "",
    ]
    tag = tag_of(case) if case else ""
    if case and case.reason:
        tag = f"{tag}, gates nothing: {case.reason}"
    return KindRow(
        kind=kind,
        page=page,
        flown=search.flown,
        still=still_address(plan.name) if page.flight.stills else "",
        facts=tuple(fact for fact in facts if fact),
        tag=tag,
        thumbnail=page.flight.thumbnail if index < MOST_THUMBNAILS else "",
    )


def control_rows(run: RunRecord) -> list[Fact]:
    """Return how diverse the kinds of each search are, and how it stands beside random flights."""
    texts = (
        (each.name, (each.diversity, each.told.get("control", ""), each.told.get("origins", "")))
        for each in run.searches
    )
    return [(name, text) for name, own in texts for text in own if text]


def phase_rows(run: RunRecord) -> list[tuple[str, str, list[tuple[int, int]]]]:
    """Return type, meaning and, by phase, (number, shade from 0 to 4) of its flights."""
    counts = run.types_by_phase
    most = max((count for row in counts.values() for count in row.values()), default=1)
    cells = {
        name: [(row[phase], _shade(row[phase], most)) for phase in PHASES]
        for name, row in counts.items()
    }
    return [(name, meaning, cells[name]) for name, meaning in LEGEND.items() if name in cells]


def _shade(count: int, most: int) -> int:
    return 0 if not count else min(4, 1 + int(4 * count / (most + 1)))


def origin_rows(run: RunRecord) -> tuple[Fact, ...]:
    """Return hash and versions, so that the index can be traced to what flew."""
    ledger = run.ledger
    return (
        ("results, SHA-256", run.results_sha256),
        ("pytest-garl", run.version),
        ("physics engine", run.options.engine or ""),
        ("Python", run.options.python or ""),
        ("ledger", f"{ledger.absolute().parent.name}/{ledger.name}"),
    )
