"""A landing system to begin with: it finds an ArUco marker, flies over it and comes down."""

from __future__ import annotations

import math

import cv2
import numpy as np

from pytest_garl import (
    Abort,
    Command,
    Detection,
    Diagnostics,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
)

GIVE_UP_S = 90.0


class MyLandingSystem:
    """Replace any part of it by your own: the detector, the plan, the commands."""

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight; called once, before take-off."""
        self.mission = mission
        dictionary = getattr(cv2.aruco, mission.marker_dictionary)
        self.detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary))
        self.target: tuple[float, float, float] | None = None

    def step(self, observation: Observation) -> Command:
        """Return what to do now; called for each camera frame, also after Land()."""
        seen = self.look(observation)
        detections: tuple[Detection, ...] = ()
        if seen is not None:
            self.target = seen
            marker = self.mission.marker_id
            detections = (Detection(marker_id=marker, confidence=1.0, position_m=seen),)
        x, y, z = (float(value) for value in observation.position_m)
        # Verdicts do not read this, but reports do: they can say what your system saw.
        diagnostics = Diagnostics(detections=detections, target_m=self.target)
        if self.target is None:
            if observation.time_s > GIVE_UP_S:
                return Abort(diagnostics=diagnostics)
            # A setpoint starts the motors and takes off.
            look_from = (*self.mission.gps_position_m, self.mission.search_altitude_m)
            return PositionSetpoint(position_m=look_from, diagnostics=diagnostics)
        tx, ty, _ = self.target
        off = math.dist((x, y), (tx, ty))
        if z < 0.5 and off < 0.3:
            return Land(diagnostics=diagnostics)
        # Come down inside a cone above the marker, so that the camera keeps it in view.
        lower = max(0.3, z - 1.0) if off < 0.2 + 0.15 * z else z
        return PositionSetpoint(position_m=(tx, ty, lower), speed_mps=1.5, diagnostics=diagnostics)

    def look(self, observation: Observation) -> tuple[float, float, float] | None:
        """Return where the marker lies in the world, if it is in the image."""
        corners, ids, _ = self.detector.detectMarkers(observation.image)
        found = () if ids is None else ids.ravel()
        for quad, marker in zip(corners, found, strict=False):
            if marker == self.mission.marker_id:
                u, v = quad[0].mean(axis=0)
                return self.on_the_ground(observation, float(u), float(v))
        return None

    def on_the_ground(
        self, observation: Observation, u: float, v: float
    ) -> tuple[float, float, float]:
        """Follow the ray of a pixel to the ground: the camera looks down, its top is forward."""
        camera = self.mission.camera
        (cx, cy), focal = camera.centre_px, camera.focal_px
        x, y, z = observation.position_m
        east, north, up = rotation(observation.attitude) @ (
            (cy - v) / focal,
            (cx - u) / focal,
            -1.0,
        )
        return float(x - z / up * east), float(y - z / up * north), 0.0


def rotation(attitude: np.ndarray) -> np.ndarray:
    """Return the matrix that turns body vectors into world vectors."""
    x, y, z, w = attitude
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
