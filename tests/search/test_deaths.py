from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pytest_garl.search.deaths import Death, settle
from pytest_garl.search.job import dump_scenario
from pytest_garl.search.ledger import Claim, Ledger
from tests.search.flying import Good, job_of, scenario

DIED = Death(status=-11, words="", complaint="no fuel")
HUNG = Death(status=1, words="Timeout (0:00:30)!\nstep", complaint="")


@pytest.fixture
def ledger(tmp_path: Path) -> Ledger:
    ledger = Ledger.create(tmp_path / "ledger.sqlite", {})
    job = job_of(Good, tmp_path / "flights")
    ledger.add_search("s", "flying:Good", "lawn", 2, job.dumps())
    ledger.add_slots("s", 0, {0: dump_scenario(scenario()), 1: dump_scenario(scenario(0.1))})
    return ledger


def claimed(ledger: Ledger) -> Claim:
    claim = ledger.claim()
    assert claim is not None
    return claim


def crash(ledger: Ledger) -> dict[str, Any]:
    result = ledger.result("s", 0, 0)
    assert result is not None
    found: dict[str, Any] = result["crash"]
    return found


@pytest.mark.parametrize(("death", "after"), [(DIED, "died"), (HUNG, "hung")])
def test_the_first_death_is_flown_again_when_nobody_else_flies(
    ledger: Ledger, death: Death, after: str
) -> None:
    first, other = claimed(ledger), claimed(ledger)
    settle(ledger, first, death)
    assert ledger.result("s", 0, 0) is None
    assert ledger.claim() is None
    ledger.record(other, {}, "", 0.0)
    again = claimed(ledger)
    assert (again.slot, again.after, again.attempt) == (0, after, 2)
    assert ledger.meters()["retried"] == 1


def test_the_second_death_is_a_finding(ledger: Ledger) -> None:
    ledger.record(claimed(ledger), {}, "", 0.0)
    for _ in range(2):
        settle(ledger, claimed(ledger), DIED)
    result = ledger.result("s", 0, 1)
    assert result is not None
    assert result["verdict"]["signature"] == "V:died:signal-11"
    assert result["crash"]["message"] == "its process ended with signal 11, twice"
    assert result["crash"]["traceback"] == "no fuel"


def test_a_call_that_hangs_again_alone_is_a_finding(ledger: Ledger) -> None:
    first = claimed(ledger)
    ledger.record(claimed(ledger), {}, "", 0.0)
    settle(ledger, first, HUNG)
    settle(ledger, claimed(ledger), HUNG)
    assert crash(ledger)["message"] == "one call took longer than 30 s of wall time, twice"
    assert crash(ledger)["traceback"] == HUNG.words


def test_what_is_given_back_is_flown_as_if_it_had_not_been_claimed(ledger: Ledger) -> None:
    first = claimed(ledger)
    ledger.give_back(first)
    assert claimed(ledger) == first
    ledger.record(claimed(ledger), {}, "", 0.0)
    settle(ledger, first, HUNG)
    alone = claimed(ledger)
    assert (alone.after, alone.attempt) == ("hung", 2)
    ledger.give_back(alone)
    assert claimed(ledger) == alone
    ledger.release(alone.pid)
    assert claimed(ledger) == alone
