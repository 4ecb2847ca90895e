"""The companion program of the docs, flown in the real simulator."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.airframe import Camera
from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.search.probes import clear_scenario
from pytest_garl.simulation.fly import fly

DOCS = Path(__file__).parents[2] / "docs"
pytestmark = pytest.mark.sim


def lander(camera: Camera) -> CompanionProgram:
    return CompanionProgram(
        "python mavlink_lander.py --marker {marker_id} --north {north_m} --east {east_m} "
        "--altitude {search_altitude_m} --focal {focal_px} --dictionary {marker_dictionary}",
        folder=DOCS / "your-stack",
        camera=camera,
    )


def test_it_lands_on_the_marker() -> None:
    map = load_map("lawn")
    task = Task(marker=map.marker, start=Start())
    scenario = clear_scenario(map, task, domain_with_policy("calm", DOCS))
    first = fly(scenario, lander(Camera()), policy_spec("stationary"), map=map)
    assert first.outcome == "landed"
    assert first.touchdown is not None
    assert first.touchdown.distance_m < 0.3
    notes = "\n".join(each.diagnostics.note for each in first.steps if each.diagnostics)
    assert "seen by its detector: 0" in notes
    assert "lands 0." in notes
