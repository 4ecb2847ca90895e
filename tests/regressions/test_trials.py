from __future__ import annotations

from pytest_garl.regressions.trials import Trials
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import problems
from tests.regressions.samples import COLLIDING_OBJECT, LAWN, OBJECT_NAMES, VIOLATING_SCENARIO


def test_trials_fly_repaired_scenarios() -> None:
    flown: list[Scenario] = []

    def fails(scenario: Scenario) -> bool:
        flown.append(scenario)
        return False

    trials = Trials(VIOLATING_SCENARIO, fails, LAWN, 10)
    trials(
        VIOLATING_SCENARIO.replace(
            {f"{COLLIDING_OBJECT}.start_x": VIOLATING_SCENARIO[f"{OBJECT_NAMES[1]}.start_x"]}
        )
    )
    assert problems(flown[0], LAWN) == ()
