"""Known cases and the twins of violations: what they excuse, and what they do not."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.triage.known_kinds import KnownCase, KnownKinds, are_alike
from tests.cases.running_search import NOTHING_UNUSUAL, RunningSearch, record
from tests.cases.samples import JOB, case

FOG = "off:of-fog"
"""How a flight in much fog ends."""
IN_FOG = NOTHING_UNUSUAL.replace({"environment.fog": 0.14})
IN_RAIN = NOTHING_UNUSUAL.replace({"environment.rain": 0.05})
IN_BOTH = IN_FOG.replace({"environment.rain": 0.05})


def _case(scenario: Scenario) -> Case:
    return dataclasses.replace(case(FOG), scenario=scenario)


def _is_excused(path: Path, flown: Scenario, *cases: Case) -> tuple[bool, int]:
    """Return whether a violation in a search is excused, and how many twins were flown."""
    ledger = Ledger.create(path / "ledger.sqlite", {})
    RunningSearch(ledger, 1)
    ledger.add_slots("search", 0, {0: dump_scenario(flown)})
    claim = ledger.queue.claim(None)
    assert claim is not None
    record(ledger, claim)
    known = [KnownCase(name=f"{index}.toml", case=each) for index, each in enumerate(cases)]
    kinds = KnownKinds(ledger, "search", parse_job(JOB.dumps()), known)
    kinds.advance()
    (violation,) = ledger.queries.violating("search")
    excused = kinds.without_twin(violation.result, flown).known is not None
    twin = kinds.twin(FOG)
    if twin is None:
        return excused, 0
    claim = ledger.queue.claim(None)
    assert claim is not None
    record(ledger, claim)
    completed = ledger.completed(twin.flight, path)
    assert completed is not None
    return excused and not kinds.is_refuted(FOG, twin, completed.result), 1


@pytest.mark.parametrize(
    ("flown", "cases", "excused", "twins"),
    [
        (IN_FOG, (_case(IN_FOG),), True, 1),
        (IN_BOTH, (_case(IN_FOG),), True, 1),
        (IN_BOTH, (_case(IN_BOTH),), True, 1),
        # Its twin without rain fails in the fog.
        (IN_BOTH, (_case(IN_RAIN),), False, 1),
        (IN_BOTH, (_case(IN_RAIN), _case(IN_FOG)), True, 1),
        # It is known to fail with nothing unusual.
        (IN_BOTH, (_case(IN_RAIN), _case(NOTHING_UNUSUAL)), True, 1),
        (IN_FOG, (_case(NOTHING_UNUSUAL),), True, 0),
        # The cause is nominal: that takes no flight.
        (IN_FOG, (_case(IN_RAIN),), False, 0),
    ],
)
def test_violation_is_excused_by_its_cause(
    tmp_path: Path, flown: Scenario, cases: tuple[Case, ...], excused: bool, twins: int
) -> None:
    assert _is_excused(tmp_path, flown, *cases) == (excused, twins)


def test_endings_of_other_phases_and_sights_are_alike() -> None:
    assert are_alike("II:lost:descent", "II:lost:approach")
    assert are_alike("off:seen", "off:unseen")
    assert not are_alike("II:lost:descent", "II:never-seen")
    assert not are_alike("IV:dog:descent:seen", "IV:person:descent:seen")
