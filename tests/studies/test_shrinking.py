"""Tests of the study of shrinking."""

from pathlib import Path

import pytest

from studies import shrinking
from studies.shrinking import Flights, job_of
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
