"""The laser rangefinder under the UAV: the distance to what lies below, along the body's axis."""

from __future__ import annotations

from pytest_garl.landing_system import Rangefinder
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.physics.vehicle import Motion
from pytest_garl.simulation.physics.world import World
from pytest_garl.simulation.randomness import generator

NOISE_M = 0.03
"""Engineering estimate: a third of the 10 cm that data sheets of such rangefinders state as
accuracy."""
DECIMALS = 2
"""Readings come in whole centimetres (LightWare SF11/C, product manual)."""


class Ranging:
    """Reads the rangefinder of one flight, or nothing if the airframe has none."""

    def __init__(self, scenario: Scenario, rangefinder: Rangefinder | None, world: World) -> None:
        self._rangefinder, self._world = rangefinder, world
        self._rng = generator(scenario.seed, "rangefinder")

    def reading_m(self, motion: Motion) -> float | None:
        """Return the distance below a UAV that moves so; None if nothing is in range."""
        if self._rangefinder is None:
            return None
        start, down = eye_under(motion.position_m, motion.attitude), (0.0, 0.0, -1.0)
        # Drawn whether something is in range or not, so that one reading does not change the next.
        noise_m = NOISE_M * float(self._rng.standard_normal())
        axis = rotate(motion.attitude, down)
        distance_m = self._world.distance_m(start, axis, self._rangefinder.most_m)
        if distance_m is None or distance_m < self._rangefinder.least_m:
            return None
        return round(distance_m + noise_m, DECIMALS)
