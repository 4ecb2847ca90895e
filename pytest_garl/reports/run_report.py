"""A run as data for other programs: the output of ``garl report --json``.

``report.schema.json`` beside this file describes it.  Keys may be added; removing a key or changing
its meaning takes a new ``version``.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pytest_garl.cases.corpus import Corpus
from pytest_garl.errors import LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.messages import command
from pytest_garl.reports.causes import cause_of
from pytest_garl.reports.search_summary import (
    SearchSummary,
    SlotUserFailure,
    Spread,
    ViolationKind,
    search_summaries,
)
from pytest_garl.reports.shares_text import control_text
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.verdicts.ending import ending_of
from pytest_garl.verdicts.paper_metrics import top_k
from pytest_garl.verdicts.statistics import share_interval
from pytest_garl.verdicts.verdict import count_decided

VERSION = 1
SCHEMA = Path(__file__).with_name("report.schema.json")


def run_report_as_json(path: Path, corpus: Corpus) -> dict[str, Any]:
    """Return the report of the run in a ledger, finished or not, with its systems' saved cases.

    Raises LedgerError if there is no ledger.
    """
    if not path.is_file():
        raise LedgerError(f"there is no ledger at {path}; run a search first")
    with contextlib.closing(Ledger(path)) as ledger:
        return run_report_of(ledger, path, corpus)


def summaries_of(ledger: Ledger, corpus: Corpus) -> list[SearchSummary]:
    """Return the summary of each search, with the causes that saved cases tell.

    Failed assertions about users' own properties are among the kinds.
    """
    failures = [SlotUserFailure(**each) for each in ledger.facts.user_failures]
    cases = [entry.case for entry in corpus.all_entries() if entry.case is not None]
    return [each.with_cases(cases) for each in search_summaries(ledger, failures)]


def run_report_of(ledger: Ledger, path: Path, corpus: Corpus) -> dict[str, Any]:
    """Return the report of the run in an open ledger, which lies at ``path``."""
    summaries = summaries_of(ledger, corpus)
    progress = ledger.queries.progress()
    slots: Counter[tuple[str, str]] = Counter()
    for each in progress:
        slots[each.system, each.map] += each.total
    saved = _cases(corpus, {summary.system for summary in summaries})
    searches = [_search(each, slots[each.system, each.map], saved, path) for each in summaries]
    meters = ledger.queries.meters()
    return {
        "schema": "pytest-garl-report",
        "version": VERSION,
        "pytest_garl": ledger.facts.version or version("pytest-garl"),
        "ledger": str(path),
        "complete": ledger.facts.ended is not None
        and all(each.flown == each.total for each in progress),
        "run": ledger.facts.reported,
        "results_sha256": ledger.queries.result_hash(),
        "time": {
            "began": ledger.facts.began,
            "ended": ledger.facts.ended,
            "flying_s": meters.get("flying_s", 0.0),
            "idle_s": meters.get("idle_s", 0.0),
        },
        "flights": {
            "wanted": sum(each.total for each in progress),
            "flown": sum(each.flown for each in progress),
            "flown_again": int(meters.get("retried", 0)),
            "beside": int(meters.get("on_demand", 0)),
        },
        "searches": searches,
        "cases": saved,
    }


def _search(
    summary: SearchSummary, slots: int, cases: list[dict[str, Any]], path: Path
) -> dict[str, Any]:
    total, verdicts = len(summary.verdicts), summary.verdicts
    low, high = share_interval(summary.violating, total)
    return {
        "system": summary.system,
        "map": summary.map,
        "wanted": slots,
        "flown": total,
        "violating": summary.violating,
        "violating_interval_95": [low, high],
        "violating_by_the_paper": summary.violating_by_the_paper,
        "tenth_violation": top_k(verdicts),
        "limits": [dataclasses.asdict(limits) for limits in summary.limits],
        "landed": summary.count("landed"),
        "completed": summary.completed,
        "gave_up": dict(summary.without_landing("gave_up")),
        "not_landed": dict(summary.without_landing("not_landed")),
        "crashes": dict(sorted(summary.crashes.items())),
        "inconclusive": summary.count("inconclusive"),
        "landing_distance_m": _spread(summary.landing_distance_m),
        "landing_time_s": _spread(summary.landing_time_s),
        "outcomes": dict(sorted(Counter(each.result.outcome for each in summary.flights).items())),
        "types": dict(
            sorted(Counter(str(v.violation_type) for v in verdicts if v.violation_type).items())
        ),
        "decided": {
            "distance": count_decided(verdicts, "distance"),
            "time": count_decided(verdicts, "time"),
        },
        "causes": len({cause_of(kind.case.severity) for kind in summary.kinds if kind.case}),
        "effective_kinds": round(summary.effective_kinds, 4),
        "control": _control(summary),
        "signatures": [
            {
                **_kind(summary, kind, path),
                "title": kind.title,
                "cause": list(cause_of(kind.case.severity)) if kind.case else None,
                "severity": _severity(kind),
                "in_control": kind.in_control,
                "cases": [
                    case["file"]
                    for case in cases
                    if (case["system"], case["map"], ending_of(case["signature"]))
                    == (summary.system, summary.map, kind.signature)
                ],
            }
            for kind in summary.kinds
        ],
        "findings": [_kind(summary, finding, path) for finding in summary.findings],
    }


def _kind(summary: SearchSummary, kind: ViolationKind, path: Path) -> dict[str, Any]:
    return {
        "signature": kind.signature,
        "type": kind.signature.partition(":")[0],
        "count": kind.count,
        "first": _flight(summary.flight(kind.first)),
        "story": kind.story,
        "headline": kind.headline,
        "repeat": _repeat_command(summary, kind.first, path),
    }


def _severity(kind: ViolationKind) -> dict[str, Any] | None:
    """Return what the shrunk case of a kind takes, or what was unusual in its least flight."""
    if kind.case is not None:
        return kind.case.severity.to_json(took=True)
    return kind.severity.to_json(took=False) if kind.severity else None


def _control(summary: SearchSummary) -> dict[str, Any] | None:
    """Return the random flights and the later ones, also at the smaller of the two numbers."""
    control = summary.control
    if control is None:
        return None
    found = control.at_equal_flights()
    arms = {
        name: {"flights": arm.flights, "kinds": arm.kinds}
        for name, arm in (("random", control.random), ("later", control.later))
    }
    equal = found and {
        "flights": found.flights,
        "random": {"mean": round(found.random, 4), "range_95": list(found.random_range)},
        "later": {"mean": round(found.later, 4), "range_95": list(found.later_range)},
    }
    return {**arms, "at_equal_flights": equal, "text": control_text(summary)}


def _spread(spread: Spread | None) -> dict[str, float] | None:
    return None if spread is None else dataclasses.asdict(spread)


def _flight(flight: LedgerFlight) -> dict[str, Any]:
    return {
        "slot": flight.id.slot_id,
        "seed": parse_scenario(flight.scenario).seed,
        "outcome": flight.result.outcome,
        "final_distance_m": flight.result.final_distance_m,
        "elapsed_s": flight.result.elapsed_s,
        "trajectory_sha256": flight.sha256,
    }


def _repeat_command(summary: SearchSummary, slot: str, path: Path) -> str:
    folder = path.parent.name
    words = ["pytest", *summary.files, f"--garl-repeat={slot}"]
    return command(*words, *(() if folder == ".garl" else ("-o", f"garl_dir={folder}")))


def _cases(corpus: Corpus, systems: set[str]) -> list[dict[str, Any]]:
    """Return the saved cases of systems, without broken files; ``garl cases check`` lists those."""
    found = []
    for entry in corpus.all_entries():
        case = entry.case
        if case is None or case.system not in systems:
            continue
        found.append(
            {
                "file": str(entry.path),
                "system": case.system,
                "map": case.scenario.map,
                "signature": case.violation.signature,
                "status": case.status,
                "reason": case.reason,
                "known": corpus.is_accepted(entry),
                "story": case.violation.description,
                "severity": case.severity.to_json(took=case.is_shrunk)
                if case.severity.about
                else None,
            }
        )
    return found
