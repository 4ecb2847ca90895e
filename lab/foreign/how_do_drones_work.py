"""The precise landing of Tiziano Fiorenzani's "How do drones work?": ArUco and GUIDED positions.

The script runs as it is, from its first line to its endless loop.  Replaced are its camera, its
link to the vehicle (DroneKit) and the old functions of OpenCV.
"""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.foreign.autopilot import Autopilot, GlobalPosition
from lab.foreign.legacy_opencv import opencv
from lab.foreign.loading import changed, module_with, run_module, with_print_calls
from lab.foreign.repository import Repository
from lab.foreign.scripted import ScriptedLandingSystem, airframe_with
from pytest_garl import Camera, Mission
from pytest_garl.fiducial import MarkerSpec

SCRIPT, TRACKER = "scripts/06_precise_landing.py", "opencv/lib_aruco_pose.py"
REPOSITORY = Repository(
    name="tizianofiorenzani/how_do_drones_work",
    commit="243547be80fa18ccc4c904fd7175ba8dea4613d4",
    licence="BSD-3-Clause",
    files={
        SCRIPT: "e248196e39287011c2e80ccda77b77a5e10ff30e6ca79dd42f475cb5695a7959",
        TRACKER: "cb3356adc39f7f1a2f689686e4545029be69060485c2a0dbe8aa7f084562076a",
    },
)
MARKER = MarkerSpec(dictionary="DICT_ARUCO_ORIGINAL", id=72, side_m=0.4)
"""The script's id and dictionary.  From where the script gives the command to land, 0.5 m above the
marker, its diagonal fills three quarters of the picture's height."""
START_HEIGHT_M = 8.0
"""From higher up the cells of this marker are smaller than three pixels."""


class HowDoDronesWorkLandingSystem(ScriptedLandingSystem):
    """The script, from a hover in GUIDED near the marker on."""

    airframe = airframe_with(Camera(width_px=960, height_px=720))
    calibration_name = "raspi"

    def reset(self, mission: Mission) -> None:
        """Prepare the script."""
        super().reset(mission)
        self._path = list(sys.path)

    def close(self) -> None:
        """End the script's thread, and take back what it adds to ``sys.path``."""
        super().close()
        sys.path[:] = self._path

    def run(self) -> None:
        """Load the tracker, then execute the script."""
        old_cv2 = opencv(lambda *_: SimpleNamespace(read=self._read, set=lambda *_: True))
        time = self.script.time_module
        shared: dict[str, Any] = {"cv2": old_cv2, "cv2.aruco": old_cv2.aruco, "time": time}
        tracker = run_module(
            with_print_calls(REPOSITORY.source(TRACKER)),
            name="opencv.lib_aruco_pose",
            file=str(REPOSITORY.folder / TRACKER),
            stand_ins=shared,
        )
        self._report_detections(tracker)
        run_module(
            changed(with_print_calls(REPOSITORY.source(SCRIPT)), self._changes),
            name="precise_landing",
            file=str(REPOSITORY.folder / SCRIPT),
            stand_ins={**shared, **self._link, "opencv.lib_aruco_pose": tracker},
        )

    @property
    def _changes(self) -> dict[str, str]:
        side_cm = self.mission.marker_side_m * 100
        return {
            "parser.parse_args()": "parser.parse_args([])",
            "marker_size     = 10 ": f"marker_size     = {side_cm!r} ",
            'cwd+"/../opencv/"': repr(self.calibration.prefix),
        }

    @property
    def _link(self) -> dict[str, ModuleType]:
        def position(lat: float, lon: float, alt: float) -> GlobalPosition:
            return GlobalPosition(lat=lat, lon=lon, alt=alt)

        dronekit = module_with(
            "dronekit",
            connect=lambda *_, **__: _Vehicle(self.autopilot),
            LocationGlobalRelative=position,
            LocationGlobal=position,
            VehicleMode=str,
            Command=object,
        )
        return {"dronekit": dronekit, "pymavlink": module_with("pymavlink", mavutil=None)}

    def _read(self) -> tuple[bool, NDArray[np.uint8]]:
        self.script.wait()
        return True, self.picture

    def _report_detections(self, tracker: ModuleType) -> None:
        """Note what the tracker finds, for the diagnostics; it is not changed by that."""
        track = tracker.ArucoSingleTracker.track

        def noted(*arguments: Any, **options: Any) -> Any:
            found = track(*arguments, **options)
            if found[0]:
                self.note_sighting(-found[2] / 100, found[1] / 100)
            return found

        tracker.ArucoSingleTracker.track = noted


class _Vehicle:
    """DroneKit's vehicle, as far as the script uses it."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot

    @property
    def location(self) -> SimpleNamespace:
        return SimpleNamespace(global_relative_frame=self._autopilot.global_position)

    @property
    def attitude(self) -> SimpleNamespace:
        return SimpleNamespace(yaw=self._autopilot.heading_rad)

    @property
    def mode(self) -> str:
        return self._autopilot.mode

    @mode.setter
    def mode(self, mode: str) -> None:
        if mode == "LAND":
            self._autopilot.land()

    def simple_goto(self, goal: GlobalPosition) -> None:
        self._autopilot.go_to(self._autopilot.place_of(goal))
