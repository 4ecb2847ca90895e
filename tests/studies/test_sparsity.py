from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.scenario import Scenario
from studies import sparsity
from studies.sparsity import Flown, search
from tests.support.results import flight_result


class Here:
    """Counts the flights, and flies in this process."""

    count = 0

    def map(self, function: Any, scenarios: Any) -> list[FlightResult]:
        found = [function(each) for each in scenarios]
        self.count += len(found)
        return found


def windy(scenario: Scenario) -> FlightResult:
    """Fail where the marker is east of its coordinate or, so that both occur, in strong wind."""
    fails = scenario["wind.mean_mps"] > 3.0 or scenario["marker.x"] > 0.3
    return flight_result("off", primary="distance") if fails else flight_result()


@pytest.mark.parametrize("method", ["random", "garl"])
def test_a_search_that_is_flown_again_flies_only_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    monkeypatch.setattr(sparsity, "fly_one", windy)
    file, pool = tmp_path / "flights.jsonl", Here()
    key = ("sparse", method, "50", "3")
    row = search(key, pool, Flown.read(file))  # type: ignore[arg-type]
    assert pool.count == 50
    lines = file.read_text().splitlines(keepends=True)
    file.write_text("".join(lines[:40]) + lines[40][:30])
    again = Here()
    assert search(key, again, Flown.read(file)) == row  # type: ignore[arg-type]
    assert again.count == 10
    assert 0 < row["violations"] < 50
    assert row["first"] <= 50


def test_more_groups_act_in_the_failing_scenarios_of_dense_drawing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sparsity, "fly_one", windy)
    flown = Flown.read(tmp_path / "flights.jsonl")
    sparse, dense = (
        search((drawing, "random", "60", "1"), Here(), flown)  # type: ignore[arg-type]
        for drawing in sparsity.DRAWINGS
    )
    assert float(sparse["active"]) <= 3 < 10 < float(dense["active"])
    text = sparsity.report([{**map_texts(each)} for each in (sparse, dense)])
    assert len(text.splitlines()) == 4


def test_only_random_searches_have_an_interval_because_bred_flights_depend_on_each_other() -> None:
    row = {
        **{"drawing": "sparse", "budget": "60", "seed": "0", "limits": "0.75 m"},
        **{"landed": "30", "excused": "15", "violations": "15", "signatures": "2"},
        **{"active": "2.50", "first": "7"},
    }
    bred, drawn = (
        [cell.strip() for cell in line.strip("|").split("|")]
        for method in ("garl", "random")
        for line in sparsity.report([{**row, "method": method}]).splitlines()[2:]
    )
    assert bred == ["sparse", "garl", "1 × 60", "50.0 %", "25.0 %", "25.0 %", "2.0", "2.5", "7.0"]
    assert drawn[3:6] == ["50.0 % [36.8, 63.2]", "25.0 % [14.7, 37.9]", "25.0 % [14.7, 37.9]"]


def map_texts(row: dict[str, Any]) -> dict[str, str]:
    return {name: str(value) for name, value in row.items()}
