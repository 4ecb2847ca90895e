from __future__ import annotations

import dataclasses
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.errors import LedgerError
from pytest_garl.execution.result import FlightResult, broken_result, parse_result
from pytest_garl.flight.flight import Crash
from pytest_garl.verdicts.verdict import Margin, Verdict
from tests.support.results import crash, flight_result

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
TEXTS = st.text("aZ9:-_ .é", max_size=12)
MARGINS = st.builds(
    Margin,
    property=st.sampled_from(["distance", "time", "collision", "crash", "abort", "own"]),
    value=NUMBERS,
    unit=TEXTS,
    decided=st.booleans(),
    reason=TEXTS,
)
VERDICTS = st.builds(
    Verdict,
    outcome=TEXTS,
    primary=st.sampled_from([None, "distance", "own"]),
    violation_type=st.sampled_from([None, "I", "late"]),
    signature=TEXTS,
    paper_violation=st.booleans(),
    margins=st.lists(MARGINS, max_size=3).map(tuple),
    story=TEXTS,
)
CRASHES = st.builds(
    Crash,
    kind=st.sampled_from(["raised", "nonsense", "died", "hung", "broke"]),
    error=TEXTS,
    message=TEXTS,
    where=TEXTS,
    traceback=TEXTS,
)
RESULTS = st.builds(
    FlightResult,
    outcome=TEXTS,
    final_distance_m=NUMBERS,
    elapsed_s=NUMBERS,
    collisions=st.lists(TEXTS, max_size=3).map(tuple),
    undecided=TEXTS,
    closest_call=TEXTS,
    closest_body=TEXTS,
    verdict=VERDICTS,
    crash=st.none() | CRASHES,
    off_marker_m=st.none() | NUMBERS,
)


@given(RESULTS)
def test_result_survives_its_text(result: FlightResult) -> None:
    text = result.dumps()
    assert parse_result(text) == result
    assert parse_result(text).dumps() == text
    assert FlightResult.from_json(json.loads(text)) == result


def test_text_holds_the_keys_that_stored_ledgers_have() -> None:
    values = json.loads(flight_result(crash=crash()).dumps())
    assert sorted(values) == [
        "closest_body",
        "closest_call",
        "collisions",
        "crash",
        "decided",
        "elapsed_s",
        "final_distance_m",
        "landed_s",
        "off_marker_m",
        "outcome",
        "severity",
        "undecided",
        "verdict",
    ]
    assert sorted(values["crash"]) == ["error", "kind", "message", "traceback", "where"]
    assert sorted(values["verdict"]) == [
        "completed",
        "excuse",
        "excuse_text",
        "findings",
        "margins",
        "outcome",
        "paper_violation",
        "primary",
        "signature",
        "story",
        "violation_type",
    ]


def test_whole_numbers_keep_their_bytes() -> None:
    text = json.dumps({**flight_result().to_json(), "elapsed_s": 30}, sort_keys=True)
    assert parse_result(text).dumps() == text


def test_result_of_another_version_is_refused() -> None:
    values = flight_result().to_json()
    with pytest.raises(ValueError, match="found other keys than expected: of a later version"):
        FlightResult.from_json({**values, "of a later version": 1})
    del values["off_marker_m"]
    with pytest.raises(ValueError, match="found other keys than expected: off_marker_m"):
        FlightResult.from_json(values)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "not valid JSON"),
        ("[]", r"found \[\], expected a table"),
        ('{"outcome": "landed"}', "found other keys than expected: closest_body"),
        (json.dumps({**flight_result().to_json(), "elapsed_s": "x"}), "elapsed_s: found 'x'"),
    ],
)
def test_damaged_text_is_a_ledger_error(text: str, words: str) -> None:
    with pytest.raises(LedgerError, match=f"a result in the ledger is damaged: .*{words}"):
        parse_result(text)


def test_escape_sequences_in_a_result_are_written_out() -> None:
    result = flight_result(story="\x1b[2J one\ntwo", collisions=("\u202e",))
    found = parse_result(result.dumps())
    assert found.verdict.story == "\\x1b[2J one\ntwo"
    assert found.collisions == ("\\u202e",)
    assert parse_result(found.dumps()) == found


def test_result_without_a_record_names_what_ended_the_flight() -> None:
    died = crash("died", error="signal-11", message="its process ended")
    result = broken_result(died, 40.0)
    assert (result.signature, result.verdict.primary) == ("V:died:signal-11", "crash")
    assert (result.final_distance_m, result.elapsed_s, result.crash) == (40.0, 120.0, died)
    unsure = broken_result(dataclasses.replace(died), 40.0, inconclusive=True)
    assert unsure.inconclusive
    assert not unsure.verdict.violation
