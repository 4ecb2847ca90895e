"""A landing system of somebody else that is one script: it runs as it is, beside the frames."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.foreign.autopilot import CONTROL_RATE_HZ, Autopilot
from lab.foreign.calibration import CalibrationFolder
from lab.foreign.script import Script
from pytest_garl import (
    Airframe,
    Camera,
    Command,
    Detection,
    Mission,
    MotorThrusts,
    Observation,
    VehicleState,
)


def airframe_with(camera: Camera) -> Airframe:
    """Return the UAV of a script: the autopilot flies its motors."""
    return Airframe(camera=camera, control_rate_hz=CONTROL_RATE_HZ)


class ScriptedLandingSystem(ABC):
    """A script with an autopilot below it, from a hover near the marker on."""

    airframe: ClassVar[Airframe]
    calibration_name: ClassVar[str]
    """Ends the names of the files from which the script reads its camera's calibration."""

    def reset(self, mission: Mission) -> None:
        """Prepare the script; it starts with the first frame."""
        self.mission = mission
        self.calibration = CalibrationFolder(mission.camera, self.calibration_name)
        self.autopilot = Autopilot(self.airframe, mission)
        self.script = Script(self.run)
        self._seen: tuple[Detection, ...] = ()

    def step(self, observation: Observation) -> Command:
        """Let the script go on for one frame."""
        self.autopilot.observe(observation)
        self._seen = ()
        self.script.resume(observation.time_s)
        return self.autopilot.command(self._seen)

    def control(self, state: VehicleState) -> MotorThrusts:
        """Fly the motors, as the autopilot does."""
        return self.autopilot.control(state)

    def close(self) -> None:
        """End the script's thread."""
        self.script.close()
        self.calibration.close()

    @abstractmethod
    def run(self) -> None:
        """Load the script and execute it, in its thread."""

    @property
    def picture(self) -> NDArray[np.uint8]:
        """The frame of the moment, in OpenCV's order of colours."""
        image = self.autopilot.observation.image
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2BGR), np.uint8)

    def note_sighting(self, forward_m: float, right_m: float) -> None:
        """Note for the diagnostics that the script's detector found the marker."""
        x, y = self.autopilot.beside(forward_m, right_m)
        place = float(x), float(y), 0.0
        self._seen = (
            Detection(marker_id=self.mission.marker_id, confidence=1.0, position_m=place),
        )
