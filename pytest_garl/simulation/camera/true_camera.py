"""The camera as the airframe says that it is mounted, and as it is: built a little different."""

from __future__ import annotations

import dataclasses
import functools
import math

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.scenario import Scenario

Quaternion = tuple[float, float, float, float]
Place = tuple[float, float]


NEAREST_RAD = math.radians(45)
STEEPEST_RAD = math.radians(80)
SHARE_OF_PICTURE = 0.8
"""A tilted camera that passes over a place shows it in its middle, as long as that is not farther
ahead than 45 degrees from below it; else it shows it lower in the picture, at this share of the way
from the middle to the edge.  Beyond 80 degrees the ground is a line."""


@functools.lru_cache(maxsize=8)
def mount_of(camera: Camera) -> Quaternion:
    """Return the turn from the camera that looks down to how it is declared, in the body."""
    yaw, tilt = camera.yaw_rad / 2, camera.tilt_rad / 2
    about_z = (0.0, 0.0, math.sin(yaw), math.cos(yaw))
    return product(about_z, (0.0, -math.sin(tilt), 0.0, math.cos(tilt)))


def looks_at(camera: Camera, place_m: Place, height_m: float) -> tuple[float, float, float]:
    """Return where a level UAV with its nose east shows its camera a place on the ground."""
    x, y = place_m
    tilt = abs(camera.tilt_rad)
    if not tilt:
        return x, y, height_m
    edge = math.atan(camera.height_px / 2 / camera.focal_px)
    ahead = min(STEEPEST_RAD, tilt, max(NEAREST_RAD, tilt - SHARE_OF_PICTURE * edge))
    away_m = math.copysign(height_m * math.tan(ahead), camera.tilt_rad)
    return x - away_m * math.cos(camera.yaw_rad), y - away_m * math.sin(camera.yaw_rad), height_m


class Mounting:
    """Turns the UAV's attitude by the errors of the mounting, beside what the airframe declares."""

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
        """Return the attitude of a UAV on which the declared camera would look as it does."""
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
