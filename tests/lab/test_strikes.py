"""The study of when events strike: stand-ins that nobody knows, and who decides."""

from __future__ import annotations

import itertools

import pytest

from lab import strikes
from lab.stand_in_model import perturbed_copy
from lab.strikes import (
    BEST,
    GENE,
    LEARNED,
    OFF_BY,
    RULE,
    Landing,
    report,
    rows_of,
    scenarios,
)
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.strikes import AtThreeMetres

COURT = load_map("court")


@pytest.fixture(scope="module")
def drawn() -> list[Scenario]:
    return list(itertools.islice(scenarios(COURT), 7))


def test_a_landing_ends_as_its_scenario_says_if_events_strike_by_their_genes(
    drawn: list[Scenario],
) -> None:
    copy = perturbed_copy(OFF_BY, 7)
    for scenario in drawn:
        landing = Landing(copy=copy, map=COURT, scenario=scenario)
        assert landing.events
        assert not scenario.decided_events
        own = copy.stand_in(scenario, COURT)
        assert landing.result(landing.at_genes()).signature == own.signature


def test_the_rule_lets_events_strike_at_the_first_decision_below_3_m(
    drawn: list[Scenario],
) -> None:
    landing = Landing(copy=perturbed_copy(OFF_BY, 7), map=COURT, scenario=drawn[0])
    struck = landing.decided_by(AtThreeMetres())
    assert {*struck} == {*landing.events}
    low = [each.time_s for each in landing.outlooks if each.moments_s[2] <= each.time_s]
    assert {*struck.values()} == {low[0]}
    lesson = landing.lesson(struck)
    assert {*lesson.struck.values()} == {int(2 * low[0])}
    assert len(lesson.rows) == len(landing.outlooks)


def test_a_study_has_a_row_for_each_decider(
    drawn: list[Scenario], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(strikes, "GENERATIONS", 1)
    monkeypatch.setattr(strikes, "SIZE", 4)
    rows = list(rows_of(7, COURT, drawn))
    violating = {row["decider"]: int(row["violating"]) for row in rows}
    assert max(violating.values()) == violating[BEST]
    assert {GENE, RULE, LEARNED} < {*violating}
    text = report(rows)
    assert f"| {BEST} | 3 | " in text
    assert "Of the strikes from which it learned it expected" in text
