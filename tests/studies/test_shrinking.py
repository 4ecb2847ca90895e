"""Tests of the study of shrinking."""

import itertools
from pathlib import Path

import pytest

from studies import shrinking
from studies.shrinking import MAPS, SYSTEMS, Flights, Violation, file_of, job_of, violations
from tests.execution.flying import scenario
from tests.support.results import flight_result


def test_flights_of_two_investigations_have_records_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shrinking, "fly_job", lambda *_: (flight_result(), "", None))
    job = job_of("opencv", "court", tmp_path)
    flown = [
        fly(job, scenario()).record
        for fly in (Flights("opencv-court-g00-s03-12"), Flights("opencv-court-g00-s04-12"))
        for _ in range(2)
    ]
    assert len(set(flown)) == 4


def test_one_violation_of_each_signature_comes_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shrinking, "FOLDER", tmp_path)
    found = {("opencv", "court"): ["I", "I", "II"], ("low-transit", "lawn"): ["I", "III"]}
    for key in itertools.product(SYSTEMS, MAPS):
        lines = [
            Violation(
                system=key[0], map=key[1], slot=f"s{index}", signature=signature, scenario=""
            ).line()
            for index, signature in enumerate(found.get(key, ()))
        ]
        file_of(key).write_text("".join(lines))
    chosen = violations(4)
    assert [(each.system, each.signature) for each in chosen] == [
        ("opencv", "I"),
        ("opencv", "II"),
        ("low-transit", "III"),
        ("low-transit", "I"),
    ]
    assert [each.slot for each in violations(60)][4:] == ["s1"]
