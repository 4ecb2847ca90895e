from __future__ import annotations

from pytest_garl.regressions.hypothesis_pass import shrink_by_hypothesis
from pytest_garl.regressions.shrink import shrink
from pytest_garl.scenarios.scenario import Scenario
from tests.regressions.samples import COLLIDING_OBJECT, LAWN, VIOLATING_SCENARIO


def fast(scenario: Scenario) -> bool:
    return scenario.get(f"{COLLIDING_OBJECT}.velocity", 0.0) >= 0.3


def test_hypothesis_lowers_genes_that_can_only_be_lowered_together() -> None:
    def unequal(scenario: Scenario) -> bool:
        fog, dust = scenario["environment.fog"], scenario["environment.dust"]
        return fast(scenario) and abs(fog - dust) < 0.01

    first = VIOLATING_SCENARIO.replace({"environment.dust": 0.12})
    plain = shrink(
        first, unequal, LAWN, 300, colliding_object=COLLIDING_OBJECT, passes=(shrink_by_hypothesis,)
    )
    assert plain.simplest["environment.fog"] == plain.simplest["environment.dust"] == 0
