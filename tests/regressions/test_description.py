from __future__ import annotations

from pytest_garl.regressions.description import describe_scenario, scenario_in_words
from tests.regressions.samples import case


def test_scenario_is_described_in_physical_units() -> None:
    scenario = case().scenario.replace({"environment.fog": 0.1})
    rows = dict(describe_scenario(scenario, ()))
    assert rows["fog_visibility_m"] == "fog, visibility 100 m"
    assert rows["marker"].endswith("m, east and north")
    (dog,) = (meaning for what, meaning in rows.items() if what.startswith("dog"))
    assert dog.startswith("a dog of up to ")


def test_one_line_names_each_condition_and_the_kind_of_a_decoy() -> None:
    changes = {"environment.fog": 0.1, "decoy-1.kind": 7.0, "wind.mean_mps": 3.0}
    line = scenario_in_words(case().scenario.replace(changes), ())
    assert "; wind.mean_mps 3 m/s: mean speed at a height of 6 m; decoy-1.kind qr-code; " in line
    assert "fog, visibility 100 m; " in line
    assert "fog_visibility_m" not in line
