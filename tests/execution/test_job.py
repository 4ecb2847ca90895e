from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.job import TIMEOUT_S, FlightJob, parse_job
from pytest_garl.execution.reference import BUILT_IN, reference_to
from pytest_garl.plugin.arguments import OPTIONS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Limits
from tests.execution.flying import Good

LAWN = load_map("lawn")
NPCS = PolicySpec(name="none", factory="nowhere:Nothing")


def job(**more: Any) -> FlightJob:
    return FlightJob.for_system(
        reference_to(Good),
        LAWN,
        NPCS,
        flights=Path("flights"),
        **more,
    )


def test_job_has_the_defaults_of_a_search() -> None:
    made = job()
    assert (made.map, made.map_sha256) == ("lawn", LAWN.sha256)
    assert (made.limits, made.timeout_s, made.simulator) == (DEFAULT_LIMITS, TIMEOUT_S, BUILT_IN)
    assert made.path == tuple(entry for entry in sys.path if entry)
    assert made.load_map() == LAWN


def test_option_has_the_default_timeout_of_a_job() -> None:
    (default,) = (option.default for option in OPTIONS if option.name == "timeout")
    assert float(default) == TIMEOUT_S


def test_job_finds_the_records_of_its_flights() -> None:
    flight = FlightId(search="0123456789", map="lawn")
    assert job().record(flight) == Path("flights/01234567-lawn-g00-s00.npz")


def test_job_survives_its_text(tmp_path: Path) -> None:
    made = job(map_folders=(tmp_path,), path=("", "/somewhere"), sources=(("a.py", "ab"),))
    assert made.path == ("/somewhere",)
    assert parse_job(made.dumps()) == made
    with pytest.raises(LedgerError, match="a job in the ledger is damaged: not valid JSON"):
        parse_job("")


@pytest.mark.parametrize(
    ("change", "differing"),
    [
        ({"limits": Limits(distance_m=1.0)}, ("limits",)),
        ({"limits": Limits(abort="violation")}, ("limits",)),
        ({"map_sha256": "two"}, ("map_sha256",)),
        ({"timeout_s": 5.0}, ("timeout_s",)),
        ({"sources": (("a.py", "ab"),)}, ("a.py",)),
        ({"npcs": PolicySpec(name="none", factory="a:B")}, ("npcs",)),
        ({"path": ("elsewhere",), "flights": "there", "map_folders": ("maps",)}, ()),
    ],
)
def test_jobs_differ_in_facts_but_not_in_folders(
    change: dict[str, Any], differing: tuple[str, ...]
) -> None:
    other = dataclasses.replace(job(), **change)
    assert job().differences(other) == differing
    assert (job().flown_facts() == other.flown_facts()) == (not differing)
