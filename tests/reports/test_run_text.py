"""The shares of a search: landed first, both definitions, no landing by its reason."""

from __future__ import annotations

from typing import Any

from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin.terminal.summary import headline_shares, legend, search_table, share_lines
from pytest_garl.reports.run_reading import kinds_of
from pytest_garl.reports.run_record import KindRecord, SearchRecord, Spread
from pytest_garl.verdicts.verdict import PAPER_LIMITS, Finding, Limits
from tests.support.results import crash, flight_result, repeated

LANDED: dict[str, Any] = {"outcome": "landed", "completed": True}
GAVE_UP: dict[str, Any] = {"outcome": "gave_up", "paper_violation": True}
NEEDLESS: dict[str, Any] = {**GAVE_UP, "signature": "II:never-seen", "primary": "time"}
"""Two landings, three flights that gave up, one that ran out of time, a crash and no decision."""
RESULTS = (
    flight_result(**LANDED, landed_s=20.0, final_distance_m=0.2),
    flight_result(**LANDED, landed_s=40.0, final_distance_m=0.6),
    flight_result(**NEEDLESS, violation_type="II"),
    flight_result(**GAVE_UP, excuse="undetectable"),
    flight_result(**GAVE_UP, excuse="blocked"),
    flight_result(outcome="not_landed", paper_violation=True, excuse="blocked"),
    flight_result(
        "V:E@a.b", outcome="crashed", primary="crash", violation_type="V", crash=crash("hung")
    ),
    flight_result(outcome="inconclusive"),
)


def record(
    results: tuple[FlightResult, ...], limits: Limits | None = None, violating: int = 0
) -> SearchRecord:
    flights = tuple(
        LedgerFlight(
            id=FlightId(search="s", map="lawn", slot=Slot(generation=0, index=index)),
            system="my_landing:Mine",
            scenario="",
            result=result,
            sha256="",
        )
        for index, result in enumerate(results)
    )
    findings = {
        finding.signature: [(each.id.slot_id, finding.story)]
        for each in flights
        for finding in each.result.verdict.findings
    }
    key = SearchKey(system="my_landing:Mine", map="lawn", tests=("test_it.py::test_it",))
    return SearchRecord(
        key=key,
        name=key.place,
        flights=flights,
        kinds=(),
        violating=violating,
        findings=kinds_of(findings),
        limits=(limits or Limits(),),
    )


def test_landed_flights_come_first_and_each_reason_has_its_share() -> None:
    search = record(RESULTS, violating=2)
    assert headline_shares(search) == "8 flown, landed 25 %, violations 25 % [3, 65]"
    assert share_lines(search) == [
        "by the paper's definition, which counts not landing: violations 62 %",
        "gave up: needless 12 %, excused 12 %, blocked 12 %; "
        "not landed 12 % (of them blocked 1); hung 12 %; inconclusive 1",
        "landings: distance median 0.40 m, worst 0.60 m; time median 30.0 s, worst 40.0 s",
        "distance decided in 0 of 8 flights, time in 0",
    ]


def test_one_violation_in_few_flights_does_not_look_like_perhaps_none() -> None:
    assert headline_shares(record(RESULTS, violating=1)).endswith("violations 12 % [0.3, 53]")


def test_search_without_landing_says_so() -> None:
    lines = share_lines(record(RESULTS[2:]))
    assert "landed 0 %: no flight landed, so nothing is known of its landings" in lines


def test_landings_beyond_the_limit_are_told_apart() -> None:
    off = flight_result(outcome="landed", signature="off:seen", primary="distance")
    assert "landed 100 %, within the limit of distance 50 %" in headline_shares(
        record((RESULTS[0], off), violating=1)
    )


def test_only_limits_that_are_not_the_default_ones_are_shown() -> None:
    assert share_lines(record(RESULTS, PAPER_LIMITS))[-1] == (
        'limits: distance 1.5 m, time 120 s, abort="violation"'
    )
    assert not any(line.startswith("limits") for line in share_lines(record(RESULTS)))


def test_spread_of_nothing_is_none() -> None:
    assert Spread.of([]) is None
    assert Spread.of([3.0, 1.0, 2.0]) == Spread(median=2.0, worst=3.0)


def test_findings_before_another_event_follow_the_violations() -> None:
    finding = Finding(
        signature="off:descending-elsewhere",
        margin=-4.0,
        unit="m",
        time_s=20.0,
        story="Came down 4.8 m north of the marker, which had been in view before.",
    )
    search = record((RESULTS[0], flight_result("IV:dog:descent:seen", findings=(finding,))))
    lines = search_table(search, repeated, 120)
    start = lines.index("  also noted, no test fails for it:")
    assert lines[start + 1].split()[:2] == ["1", "off:descending-elsewhere"]
    assert "--garl-repeat=lawn-g00-s01" in lines[start + 1]
    assert lines[start + 2].strip() == (
        "came down 4.8 m north of the marker, which had been in view before"
    )
    assert legend(search.findings) == "off: came down too far from the marker, up to 1.5 m"


def test_legend_speaks_of_plans_where_the_uav_held_its_place() -> None:
    def kinds(*signatures: str) -> list[KindRecord]:
        return [
            KindRecord(signature=each, slots=("lawn-g00-s00",), story="") for each in signatures
        ]

    assert legend(kinds("IV:dog:descent:seen")) == "IV: hit a moving body"
    assert legend(kinds("IV:dog:plan:unseen", "II:lost:hold")) == (
        "II: did not report the marker while it could be read; "
        "IV: planned a path through a moving body"
    )


def test_never_giving_up_where_nobody_could_land_is_not_needless() -> None:
    late: dict[str, Any] = {
        "outcome": "not_landed",
        "paper_violation": True,
        "signature": "late:never-gave-up",
        "violation_type": "late",
        "primary": "time",
    }
    unseen = flight_result(**late, story="Not landed. Nobody could see the marker: 0.8 s.")
    blocked = flight_result(**late, story="Not landed. The marker was blocked: 2 s.")
    told = record((unseen, unseen, blocked)).not_landed
    assert told == {"needless": 0, "excused": 2, "blocked": 1}
