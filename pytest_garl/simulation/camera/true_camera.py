"""The camera as it is: mounted and built a little different from what the airframe says."""

from __future__ import annotations

import dataclasses
import math

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.scenario import Scenario

Quaternion = tuple[float, float, float, float]


class Mounting:
    """Turns the UAV's attitude into that of its camera."""

    def __init__(self, scenario: Scenario) -> None:
        roll, pitch, yaw = (
            math.radians(scenario[f"camera.mounting_{axis}_deg"]) / 2
            for axis in ("roll", "pitch", "yaw")
        )
        self._turn: Quaternion | None = None
        if roll or pitch or yaw:
            about_z = (0.0, 0.0, math.sin(yaw), math.cos(yaw))
            about_y = (0.0, math.sin(pitch), 0.0, math.cos(pitch))
            about_x = (math.sin(roll), 0.0, 0.0, math.cos(roll))
            self._turn = product(product(about_z, about_y), about_x)

    def attitude(self, attitude: Quaternion) -> Quaternion:
        """Return the attitude of the camera on a UAV with an attitude."""
        return attitude if self._turn is None else product(attitude, self._turn)


def true_camera(camera: Camera, scenario: Scenario) -> Camera:
    """Return the declared camera with its true focal length."""
    error = scenario["camera.calibration_error_percent"] / 100
    if error == 0:
        return camera
    angle = 2 * math.atan(camera.width_px / 2 / (camera.focal_px * (1 + error)))
    # Within what can be drawn: the widest camera errs by less.
    return dataclasses.replace(camera, field_of_view_rad=min(3.0, max(0.05, angle)))


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the quaternion that turns by ``b``, then by ``a``."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
