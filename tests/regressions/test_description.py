from __future__ import annotations

from pytest_garl.regressions.description import describe_scenario
from tests.regressions.samples import case


def test_scenario_is_described_in_physical_units() -> None:
    scenario = case().scenario.replace({"environment.fog": 0.1})
    rows = dict(describe_scenario(scenario, ()))
    assert rows["fog_visibility_m"] == "fog, visibility 100 m"
    assert rows["marker"].endswith("m, east and north")
    (dog,) = (meaning for what, meaning in rows.items() if what.startswith("dog"))
    assert dog.startswith("a dog of up to ")
