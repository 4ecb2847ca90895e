"""A run as data for other programs: the output of ``garl report --json``.

``report.schema.json`` beside this file describes it.  Keys may be added; removing a key or changing
its meaning takes a new ``version``.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.reports.control_arm import ControlArm
from pytest_garl.reports.run_record import (
    KindRecord,
    RunRecord,
    SavedCase,
    SearchRecord,
    Spread,
)

VERSION = 1
SCHEMA = Path(__file__).with_name("report.schema.json")


def run_as_json(run: RunRecord) -> dict[str, Any]:
    """Return a run as values for JSON."""
    return {
        "schema": "pytest-garl-report",
        "version": VERSION,
        "pytest_garl": run.version,
        "ledger": str(run.ledger),
        "complete": run.complete,
        "run": dataclasses.asdict(run.options),
        "results_sha256": run.results_sha256,
        "time": {
            "began": run.began,
            "ended": run.ended,
            "flying_s": run.costs.flying_s,
            "idle_s": run.costs.idle_s,
        },
        "flights": {
            "wanted": run.wanted,
            "flown": run.flown,
            "flown_again": run.costs.flown_again,
            "beside": run.costs.beside,
        },
        "searches": [_search(each) for each in run.searches],
        "cases": [_case(each) for each in run.cases],
    }


def _search(search: SearchRecord) -> dict[str, Any]:
    return {
        "system": search.key.system,
        "map": search.key.map,
        **_told_apart(search),
        "wanted": search.wanted,
        "flown": search.flown,
        "violating": search.violating,
        "violating_interval_95": list(search.violating_interval),
        "violating_by_the_paper": search.violating_by_the_paper,
        "tenth_violation": search.tenth_violation,
        "limits": [dataclasses.asdict(limits) for limits in search.limits],
        "landed": search.landed,
        "completed": search.completed,
        "gave_up": dict(search.gave_up),
        "not_landed": dict(search.not_landed),
        "crashes": dict(sorted(search.crashes.items())),
        "inconclusive": len(search.inconclusive),
        "landing_distance_m": _spread(search.landing_distance_m),
        "landing_time_s": _spread(search.landing_time_s),
        "outcomes": dict(sorted(search.outcomes.items())),
        "types": dict(sorted(search.types.items())),
        "decided": dict(search.decided),
        "causes": search.causes,
        "effective_kinds": round(search.effective_kinds, 4),
        "control": search.control and _control(search.control, search.told["control"]),
        "origins": [dataclasses.asdict(each) for each in search.origins],
        "model": None if search.model is None else dataclasses.asdict(search.model),
        "movers": None if search.movers is None else dataclasses.asdict(search.movers),
        "director": None if search.director is None else dataclasses.asdict(search.director),
        "strikes": None if search.strikes is None else dataclasses.asdict(search.strikes),
        "event_director": None
        if search.event_director is None
        else dataclasses.asdict(search.event_director),
        "signatures": [
            {
                **_kind(search, kind),
                "title": kind.title,
                "cause": None if kind.cause is None else list(kind.cause),
                "severity": _severity(kind),
                "in_control": kind.in_control,
                "cases": [str(each.path) for each in kind.saved],
            }
            for kind in search.kinds
        ],
        "findings": [_kind(search, finding) for finding in search.findings],
    }


def _told_apart(search: SearchRecord) -> dict[str, Any]:
    """Return what tells a search from others of its landing system on its map; else nothing."""
    if search.name == search.key.place:
        return {}
    return {"name": search.name, "domain": search.key.domain, "tests": list(search.key.tests)}


def _kind(search: SearchRecord, kind: KindRecord) -> dict[str, Any]:
    return {
        "signature": kind.signature,
        "type": kind.type,
        "count": kind.count,
        "first": _flight(search.by_slot[kind.first]),
        "story": kind.story,
        "headline": kind.headline,
        "repeat": kind.repeat,
    }


def _severity(kind: KindRecord) -> dict[str, Any] | None:
    """Return what the shrunk case of a kind takes, or what was unusual in its least flight."""
    if kind.case is not None:
        return kind.case.severity.to_json(took=True)
    return kind.severity.to_json(took=False) if kind.severity else None


def _control(control: ControlArm, text: str) -> dict[str, Any]:
    """Return the random flights and the later ones, also at the smaller of the two numbers."""
    found = control.at_equal_flights
    arms = {
        name: {"flights": arm.flights, "kinds": arm.kinds}
        for name, arm in (("random", control.random), ("later", control.later))
    }
    equal = found and {
        "flights": found.flights,
        "random": {"mean": round(found.random, 4), "range_95": list(found.random_range)},
        "later": {"mean": round(found.later, 4), "range_95": list(found.later_range)},
    }
    return {**arms, "at_equal_flights": equal, "text": text}


def _spread(spread: Spread | None) -> dict[str, float] | None:
    return None if spread is None else dataclasses.asdict(spread)


def _flight(flight: LedgerFlight) -> dict[str, Any]:
    return {
        "slot": flight.id.slot_id,
        "seed": flight.seed,
        "outcome": flight.result.outcome,
        "final_distance_m": flight.result.final_distance_m,
        "elapsed_s": flight.result.elapsed_s,
        "trajectory_sha256": flight.sha256,
    }


def _case(saved: SavedCase) -> dict[str, Any]:
    """Return a saved case; ``garl cases check`` lists broken files."""
    case = saved.case
    severity = case.severity.to_json(took=case.is_shrunk) if case.severity.about else None
    return {
        "file": str(saved.path),
        "system": case.system,
        "map": case.scenario.map,
        "signature": case.violation.signature,
        "status": case.status,
        "reason": case.reason,
        "known": saved.known,
        "story": case.violation.description,
        "severity": severity,
    }
