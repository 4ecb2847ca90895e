from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.severity import Severity
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.archive import Archive
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import FlownScenario
from pytest_garl.verdicts.verdict import Finding, Margin
from tests.support.results import flight_result

COLUMNS = Columns(genome_of(domain_named("field"), load_map("court")))
ROW = COLUMNS.genome.nominal
SCENARIO = decode(ROW, COLUMNS.genome, map="court", seed=0)


def flown(result: FlightResult) -> FlownScenario:
    return FlownScenario(scenario=SCENARIO, result=result)


def test_the_first_violation_of_a_kind_is_worth_more_than_the_fourth() -> None:
    archive, item = Archive(COLUMNS), flown(flight_result("IV:dog:descent:seen"))
    worths = [archive.add(item, ROW) for _ in range(4)]
    assert worths == pytest.approx([1.0, 1 / 2, 1 / 3, 1 / 4])
    assert archive.names() == ["IV:dog:descent:seen"]


def test_the_parents_of_a_cell_are_its_least_severe_violations_nearest_to_nominal() -> None:
    archive, rng = Archive(COLUMNS), np.random.default_rng(0)
    kinds = [("chasing", 4.0), ("careless", 4.0), ("careless", 1.0), ("curious", 1.0)]
    for grade, speed in kinds:
        severity = Severity(about="body", grade=grade, type="dog", objects=1, speed_mps=speed)
        result = dataclasses.replace(flight_result("IV:dog:descent:seen"), severity=severity)
        archive.add(flown(result), ROW)
    found = {
        entry.flown.result.severity.text
        for entry in (archive.parent("IV:dog:descent:seen", rng) for _ in range(50))
        if entry.flown.result.severity
    }
    assert found == {
        "a careless dog at 1.0 m/s",
        "a careless dog at 4.0 m/s",
        "a curious dog at 1.0 m/s",
    }


def test_what_had_gone_wrong_before_is_a_cell_of_its_own_and_worth_half_a_violation() -> None:
    archive = Archive(COLUMNS)
    finding = Finding(signature="off:elsewhere", margin=-1.0, unit="m", time_s=9.0, story="A.")
    assert archive.add(flown(flight_result(findings=(finding,))), ROW) == 0.5
    assert archive.names() == ["off:elsewhere"]


def test_flights_in_which_nobody_could_have_landed_are_no_success() -> None:
    archive = Archive(COLUMNS)
    margins = (Margin(property="distance", value=-4.0, unit="m"),)
    excused = flight_result(outcome="gave_up", excuse="undetectable", margins=margins)
    assert archive.add(flown(excused), ROW) == 0.0
    assert archive.names() == []
