from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.npcs.training.uav_models import (
    AvoidanceParameters,
    AvoidingPilot,
    FlightStyle,
    StraightPilot,
)
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from tests.support.situations import MAP


def test_styles_and_parameters_are_drawn_from_the_generator_alone() -> None:
    for drawn in (FlightStyle.drawn, AvoidanceParameters.drawn):
        first, again, other = (drawn(np.random.default_rng(seed)) for seed in (0, 0, 1))
        assert first == again != other


@pytest.mark.sim
@pytest.mark.parametrize("pilot", [StraightPilot, AvoidingPilot])
def test_a_uav_lands_on_a_free_marker(pilot: type[StraightPilot]) -> None:
    (scenario,) = random_scenarios(MAP, genome_for(MAP), 7, 0, 1)
    flight = fly(scenario, pilot, policy_spec("stationary"), map=MAP)
    assert flight.outcome == "landed"
    assert flight.final_distance_m < 0.5
