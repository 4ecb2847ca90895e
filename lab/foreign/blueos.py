"""The BlueOS extension "Precision Landing" by Randy Mackay: AprilTag to LANDING_TARGET.

Its main loop, its detector, its conversion to angles and its messages run as they are.  Replaced
are its video stream, the HTTP link to the vehicle and its web pages.  The vehicle is ArduPilot's
precision landing, with a gimbal that holds the camera level.
"""

from __future__ import annotations

import json
import logging
import math
import types
import urllib.error
from collections.abc import Generator
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.foreign.autopilot import CONTROL_RATE_HZ, Autopilot
from lab.foreign.loading import module_with, run_module, selected
from lab.foreign.repository import Repository
from lab.foreign.script import Clock
from landing_systems.modules.detection_opencv import CAMERA_FROM_BODY, rotation_matrix
from pytest_garl import (
    Airframe,
    Camera,
    Command,
    Detection,
    Mission,
    MotorThrusts,
    Observation,
    Rangefinder,
    VehicleState,
)
from pytest_garl.fiducial import MarkerSpec

REPOSITORY = Repository(
    name="BlueOS-community/blueos-precision-landing",
    commit="fef6a58bd255cf34d37e6da5854eda7363517dc7",
    licence="GPL-3.0",
    files={
        "app/april_tags.py": "a69d87d674282b0688e8f62ff4b61c806c412586b302a3047a8a2084bcae90cc",
        "app/image_correction.py": (
            "6a1edc1ca2c943b23a5b8cb0507994d0245b283c832b13aeb7cbabb9846a18d1"
        ),
        "app/main.py": "10de136a5a6bd8812b526dd9383f0c78deee3923fe928451079d0447929ac74c",
        "app/mavlink_interface.py": (
            "a9a2495dad48327b71aa13173555a0c28d268683df63d235ebd04690a14b1790"
        ),
        "app/settings.py": "a7dc970067b8fd5e852ab841f40aa946b890ca1385029f02eb4fc23aaa574a5d",
    },
)
MAIN = (
    "logger",
    "precision_landing_running",
    "gimbal_down_q",
    "start_precision_landing_internal",
    "calculate_vertical_fov",
    "angle_between_quaternions",
)
"""What is used of main.py; the rest is the web server."""
FAMILY = "tag36h11"
MARKER = MarkerSpec(dictionary="DICT_APRILTAG_36h11", id=7, side_m=1.0)
CAMERA_TYPE, FIELD_OF_VIEW_DEG = "siyi-a8", 81
"""The extension's default camera."""
START_HEIGHT_M = 15.0
"""ArduPilot's RTL_ALT, from which RTL goes over to LAND."""


class BlueOsLandingSystem:
    """The extension and ArduPilot in LAND, from a hover near the marker on."""

    airframe = Airframe(
        camera=Camera(
            width_px=640, height_px=360, field_of_view_rad=math.radians(FIELD_OF_VIEW_DEG)
        ),
        rangefinder=Rangefinder(),
        control_rate_hz=CONTROL_RATE_HZ,
    )

    def reset(self, mission: Mission) -> None:
        """Load the extension, and set it up as its settings page does."""
        self._mission = mission
        self._folder = TemporaryDirectory(prefix="garl-foreign-")
        self._clock = Clock()
        self._autopilot = Autopilot(self.airframe, mission, precision_landing=True)
        self._log = logging.getLogger("precision-landing")
        self._log.propagate = False
        self._log.addHandler(logging.NullHandler())
        self._coroutine = self._load().start_precision_landing_internal(CAMERA_TYPE, "rtsp://")
        self._wakes_s = -math.inf

    def step(self, observation: Observation) -> Command:
        """Let the main loop look at one frame, unless it sleeps."""
        autopilot = self._autopilot
        autopilot.observe(observation)
        autopilot.land()
        self._clock.set(observation.time_s)
        if self._clock.time() >= self._wakes_s:
            self._wakes_s = self._clock.time() + self._coroutine.send(None)
        target = autopilot.target_m
        seen: tuple[Detection, ...] = ()
        if target is not None:
            seen = (Detection(marker_id=MARKER.id, confidence=1.0, position_m=target),)
        return autopilot.command(seen, f"precision landing: {autopilot.precision_status}")

    def control(self, state: VehicleState) -> MotorThrusts:
        """Fly the motors, as the autopilot does."""
        return self._autopilot.control(state)

    def close(self) -> None:
        """End the main loop and remove its settings."""
        self._coroutine.close()
        self._folder.cleanup()

    def _load(self) -> Any:
        app = module_with("app")
        time = SimpleNamespace(time=self._clock.time)
        stand_ins: dict[str, Any] = {
            "app": app,
            "time": time,
            "asyncio": module_with("asyncio", sleep=_sleep),
            "urllib": module_with("urllib", request=self._http, error=urllib.error),
            "fastapi": module_with("fastapi", **dict.fromkeys(("FastAPI", "Query"), None)),
            "fastapi.staticfiles": module_with("staticfiles", StaticFiles=None),
            "fastapi.responses": module_with("responses", JSONResponse=None),
            "fastapi.requests": module_with("requests", Request=None),
        }
        app.__dict__["image_capture"] = module_with(
            "image_capture",
            capture_frame_from_stream=self._capture,
            cleanup_video_capture=lambda: None,
        )
        for name in ("settings", "image_correction", "april_tags", "mavlink_interface"):
            app.__dict__[name] = self._run(f"app/{name}.py", stand_ins)
            if name == "settings":
                app.settings.SETTINGS_FILE = Path(self._folder.name) / "settings.json"
                app.settings.update_apriltag_settings(FAMILY, self._mission.marker_id, 1)
        return self._run("app/main.py", stand_ins, MAIN)

    def _run(self, path: str, stand_ins: dict[str, Any], names: tuple[str, ...] = ()) -> Any:
        source = REPOSITORY.source(path)
        return run_module(
            selected(source, names) if names else source,
            name=path,
            file=str(REPOSITORY.folder / path),
            stand_ins=stand_ins,
        )

    def _capture(self, _: str) -> dict[str, Any]:
        frame = np.asarray(cv2.cvtColor(self._levelled(), cv2.COLOR_RGB2BGR), np.uint8)
        height, width = frame.shape[:2]
        return {"success": True, "frame": frame, "width": width, "height": height, "message": ""}

    def _levelled(self) -> NDArray[np.uint8]:
        """Return the picture as a gimbal with the same heading would take it."""
        observation, autopilot = self._autopilot.observation, self._autopilot
        c, s = math.cos(autopilot.yaw_rad), math.sin(autopilot.yaw_rad)
        level = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turn = CAMERA_FROM_BODY @ rotation_matrix(observation.attitude).T @ level
        K = self._mission.camera.matrix
        shift = K @ turn @ CAMERA_FROM_BODY.T @ np.linalg.inv(K)
        size = (self._mission.camera.width_px, self._mission.camera.height_px)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return np.asarray(
            cv2.warpPerspective(observation.image, shift, size, flags=flags), np.uint8
        )

    @property
    def _http(self) -> SimpleNamespace:
        return SimpleNamespace(Request=_Request, urlopen=self._open)

    def _open(self, request: _Request, timeout: float) -> _Response:
        """Answer as MAV2Rest does."""
        if request.data is None:
            # The gimbal looks straight down.
            return _Response(json.dumps({"message": {"q": [0.7071, 0.0, -0.7071, 0.0]}}))
        message = json.loads(request.data)["message"]
        if message["type"] == "LANDING_TARGET":
            self._autopilot.landing_target(message)
        return _Response("")


@types.coroutine
def _sleep(seconds: float) -> Generator[float, None, None]:
    yield seconds


class _Request:
    def __init__(self, url: str, data: bytes | None = None) -> None:
        self.url, self.data = url, data

    def add_header(self, name: str, value: str) -> None:
        """Headers say nothing here."""


class _Response:
    def __init__(self, text: str) -> None:
        self._text = text

    def __enter__(self) -> _Response:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is open."""

    def getcode(self) -> int:
        return 200

    def read(self) -> bytes:
        return self._text.encode()
