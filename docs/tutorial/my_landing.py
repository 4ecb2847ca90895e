"""A first landing stack: ArUco, fly over the marker, come down."""

import math

import cv2
import numpy as np

from pytest_garl import (
    Abort,
    Airframe,
    Command,
    Diagnostics,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)

LOST_S = 3.0
GIVE_UP_S = 45.0


class MyLandingSystem:
    """Knows where the marker was last seen, and nothing about what else is there."""

    airframe = Airframe()

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        self.mission = mission
        dictionary = getattr(cv2.aruco, mission.marker_dictionary)
        parameters = cv2.aruco.DetectorParameters()
        # Leaves and snow on the marker bend its outline and flip bits of its border.
        parameters.polygonalApproxAccuracyRate = 0.06
        parameters.maxErroneousBitsInBorderRate = 0.5
        self.detector = cv2.aruco.ArucoDetector(
            cv2.aruco.getPredefinedDictionary(dictionary), parameters
        )
        self.airborne = False
        self.target: tuple[float, float] | None = None
        self.seen_s = 0.0

    def step(self, observation: Observation) -> Command:
        """Climb, find the marker, stay above it, come down."""
        x, y, z = (float(value) for value in observation.position_m)
        top = self.mission.search_altitude_m
        self.airborne = self.airborne or z > top - 1.0
        if not self.airborne:
            return PositionSetpoint(position_m=(x, y, top))
        if observation.time_s > GIVE_UP_S and z > 2.0:
            return Abort()
        self.look(observation)
        if self.target is None:
            return PositionSetpoint(position_m=(*self.mission.gps_position_m, top))
        diagnostics = Diagnostics(target_m=(*self.target, 0.0))
        if observation.time_s - self.seen_s > LOST_S and z > 1.5:
            return PositionSetpoint(position_m=(*self.target, top), diagnostics=diagnostics)
        if z < 0.3:
            return Land(diagnostics=diagnostics)
        off = math.dist((x, y), self.target)
        sink = 0.8 if off < 0.3 + 0.2 * z else 0.0
        vx, vy = (
            max(-2.0, min(2.0, aim - at)) for aim, at in zip(self.target, (x, y), strict=True)
        )
        return VelocitySetpoint(velocity_mps=(vx, vy, -sink), diagnostics=diagnostics)

    def look(self, observation: Observation) -> None:
        """Where the marker's centre is, if it is in the picture: the UAV hovers nearly level."""
        corners, ids, _ = self.detector.detectMarkers(observation.image)
        for quad, found in zip(corners, () if ids is None else ids.ravel(), strict=False):
            if found == self.mission.marker_id:
                u, v = quad[0].mean(axis=0)
                self.target = self.on_the_ground(observation, u, v)
                self.seen_s = observation.time_s

    def on_the_ground(self, observation: Observation, u: float, v: float) -> tuple[float, float]:
        """Follow the ray of a pixel down to the ground."""
        camera = self.mission.camera
        (cx, cy), focal = camera.centre_px, camera.focal_px
        ray = rotation(observation.attitude) @ [(cy - v) / focal, (cx - u) / focal, -1.0]
        x, y, z = observation.position_m
        return float(x - z / ray[2] * ray[0]), float(y - z / ray[2] * ray[1])


def rotation(attitude: np.ndarray) -> np.ndarray:
    """From the body's axes to the world's."""
    x, y, z, w = attitude
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
