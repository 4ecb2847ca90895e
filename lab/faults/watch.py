"""What stands or moves below, for a UAV whose altimeter errs."""

from __future__ import annotations

import dataclasses

import numpy as np

from landing_systems.modules.movement_watch import MovementWatch
from pytest_garl import Observation

STRIDE_PX = 8
LEAST_SHARE = 0.3
"""With fewer measurements the altimeter is believed."""
MOST_ERROR_M = 1.0
"""A larger difference is no error of the altimeter but something large below."""


class Watch(MovementWatch):
    """Measures heights from the ground in the depth picture, not from the altimeter's zero."""

    def points_in_the_way(self, observation: Observation) -> int:
        """Count the points in the way, with the height that the depth picture shows."""
        height = self.height_m(observation)
        x, y, _ = observation.position_m
        place = np.array([x, y, height])
        return super().points_in_the_way(dataclasses.replace(observation, position_m=place))

    def height_m(self, observation: Observation) -> float:
        """Return the height above the ground: the median depth below a nearly level UAV."""
        told = float(observation.position_m[2])
        depth = observation.depth_m[::STRIDE_PX, ::STRIDE_PX]
        known = depth[depth > 0]
        if len(known) < LEAST_SHARE * depth.size:
            return told
        x, y, _, _ = (float(value) for value in observation.attitude)
        upright = 1 - 2 * (x * x + y * y)
        measured = float(np.median(known)) * upright
        return measured if abs(measured - told) < MOST_ERROR_M else told
