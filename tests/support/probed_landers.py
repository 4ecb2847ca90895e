"""A small landing system that reads markers, and variants of it with bugs of published ones."""

from __future__ import annotations

import math

import cv2
import numpy as np

from pytest_garl import (
    Abort,
    Airframe,
    Camera,
    Command,
    Land,
    Mission,
    Observation,
    VelocitySetpoint,
)

LOST_S = 1.0
GIVE_UP_S = 12.0
CLIMB_MPS, SINK_MPS, GAIN = 1.0, 0.5, 0.5
LAND_M = 2.2
"""Below this height the marker fills the picture."""
Place = tuple[float, float]


class Lander:
    """Hovers over the pad at the start: centres the marker, comes down, gives up if it is gone."""

    airframe = Airframe(camera=Camera(width_px=320, height_px=240))

    def reset(self, mission: Mission) -> None:
        self.mission = mission
        dictionary = getattr(cv2.aruco, mission.marker_dictionary)
        self.detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary))
        self.error: Place | None = None
        """How far the marker is ahead and to the left."""
        self.seen_s = 0.0
        self.lands = False

    def step(self, observation: Observation) -> Command:
        height = float(observation.position_m[2])
        error = self.error = self.look(observation) or self.error
        self.lands = self.lands or (error is not None and height < LAND_M)
        if self.lands:
            return Land()
        if error is None or self.is_lost(observation.time_s):
            if observation.time_s > GIVE_UP_S:
                return Abort()
            return VelocitySetpoint(velocity_mps=(0.0, 0.0, CLIMB_MPS if height < 6 else 0.0))
        x, y = error
        sink = SINK_MPS if math.hypot(x, y) < height else 0.0
        return VelocitySetpoint(velocity_mps=(GAIN * x, GAIN * y, -sink))

    def is_lost(self, time_s: float) -> bool:
        return time_s - self.seen_s > LOST_S

    def look(self, observation: Observation) -> Place | None:
        """Return how far the marker is ahead and to the left, if the picture shows it."""
        corners, ids, _ = self.detector.detectMarkers(observation.image)
        for quad, each in zip(corners, () if ids is None else ids.ravel(), strict=False):
            if self.is_mine(int(each)):
                self.seen_s = observation.time_s
                return self.place_of(quad[0].mean(axis=0), float(observation.position_m[2]))
        return None

    def is_mine(self, marker_id: int) -> bool:
        return marker_id == self.mission.marker_id

    def place_of(self, pixel: np.ndarray, height: float) -> Place:
        """Return how far ahead (east) and to the left (north) a pixel lies; it flies level."""
        camera = self.mission.camera
        (cx, cy), focal = camera.centre_px, camera.focal_px
        return float((cy - pixel[1]) / focal * height), float((cx - pixel[0]) / focal * height)


class FirstOfTheList(Lander):
    """Takes the first marker that its detector lists, whatever its id."""

    def is_mine(self, marker_id: int) -> bool:
        return True


class GoesOn(Lander):
    """Looks before it comes down, and then no loss of the marker stops it: the last error stays."""

    def is_lost(self, time_s: float) -> bool:
        return False


class ZeroByDefault(GoesOn):
    """Takes an error that was not measured yet for zero, so that it lands when it sees nothing."""

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.error = (0.0, 0.0)
