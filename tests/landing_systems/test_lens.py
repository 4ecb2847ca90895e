"""The reference systems land with a lens that distorts."""

from __future__ import annotations

from typing import Any

import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from landing_systems.tphyolo_mls import TphYoloLandingSystem
from pytest_garl import Airframe, Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, nominal

BARREL = Airframe(camera=Camera(distortion=(-0.28, 0.08, 0.0, 0.0)))


@pytest.mark.sim
@pytest.mark.parametrize("system", [OpenCvLandingSystem, TphYoloLandingSystem])
def test_a_system_lands_on_the_marker_that_its_lens_bends(system: type[Any]) -> None:
    bent = type("Bent", (system,), {"airframe": BARREL})
    scenario = nominal(marker__x=0.5, marker__y=-0.4)
    flight = fly(scenario, bent, policy_spec("stationary"), map=EMPTY)
    assert flight.outcome == "landed", flight.crash
    assert flight.final_distance_m < 0.3
