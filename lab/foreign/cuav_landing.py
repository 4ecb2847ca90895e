"""The precision landing of Sanket Sharma for CUAV: ArUco, one offset in GUIDED, then LAND.

The script runs as it is, its ``main`` included.  Replaced are its camera stream, its link to the
vehicle (pymavlink) and the old functions of OpenCV.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from lab.foreign.autopilot import Autopilot
from lab.foreign.legacy_opencv import opencv
from lab.foreign.loading import changed, module_with, run_module
from lab.foreign.repository import Repository
from lab.foreign.script import Script
from lab.foreign.scripted import ScriptedLandingSystem, airframe_with
from pytest_garl import Camera, Command, Mission, Observation
from pytest_garl.fiducial import MarkerSpec

SCRIPT, DETECTOR = "python_sim/cuav_landing.py", "python_sim/aruco_calc.py"
REPOSITORY = Repository(
    name="snktshrma/precision-landing",
    commit="49aee46bda00371960ee9a8a1f5b9b842b0765a0",
    licence="MIT",
    files={
        SCRIPT: "9f5d9b4022124b4e0370715385549a2bd00da478417900400505ce161b00e154",
        DETECTOR: "30d6f726c8e24a8b4e35968ecd531fdf63db8737d191698ceb771b7b6eedeb90",
    },
)
MARKER = MarkerSpec(dictionary="DICT_6X6_250", id=1, side_m=1.5)
"""The script's id and dictionary."""
START_HEIGHT_M = 10.0
"""Twice the script's own height, so that the camera sees a marker that lies 7 m aside."""
ELEVATION_M = 100 * (START_HEIGHT_M + 1) - START_HEIGHT_M
"""Height of the airfield above the sea.  The script takes a hundredth of the height above the sea,
less one, for the height above the ground, and flies on from a matching airfield only."""
MAVLINK = {
    "MAV_CMD_NAV_LAND": 21,
    "MAV_CMD_NAV_TAKEOFF": 22,
    "MAV_CMD_NAV_RETURN_TO_LAUNCH": 20,
    "MAV_CMD_DO_SET_MODE": 176,
    "MAV_CMD_COMPONENT_ARM_DISARM": 400,
    "MAV_CMD_SET_MESSAGE_INTERVAL": 511,
    "MAV_FRAME_LOCAL_NED": 1,
    "MAV_FRAME_BODY_OFFSET_NED": 9,
}
"""Numbers of MAVLink's common messages."""


class CuavLandingSystem(ScriptedLandingSystem):
    """The script, from a hover above the told coordinate on."""

    airframe = airframe_with(Camera(width_px=640, height_px=480))
    calibration_name = "webcam"

    def reset(self, mission: Mission) -> None:
        """Prepare the script and its link."""
        super().reset(mission)
        self._link = _Link(self.autopilot, self.script, mission)

    def step(self, observation: Observation) -> Command:
        """Let the script go on for one frame, with new telemetry."""
        self._link.unread = set(_Link.TELEMETRY)
        return super().step(observation)

    def run(self) -> None:
        """Load the detector, then execute the script."""
        old_cv2 = opencv(lambda *_: None)
        quiet = module_with("logging", basicConfig=_nothing, info=_nothing, warning=_nothing)
        shared: dict[str, Any] = {
            "cv2": old_cv2,
            "cv2.aruco": old_cv2.aruco,
            "tf": module_with("tf"),
            "time": self.script.time_module,
            "signal": module_with("signal", SIGINT=2, signal=_nothing),
            "logging": module_with("logging", **vars(quiet), NOTSET=0),
        }
        detector = run_module(
            changed(
                REPOSITORY.source(DETECTOR),
                {
                    "marker_size  = 58.5937500001": f"marker_size = {100 * MARKER.side_m!r}",
                    'calib_path  = ""': f"calib_path = {self.calibration.prefix!r}",
                },
            ),
            name="aruco_calc",
            file=str(REPOSITORY.folder / DETECTOR),
            stand_ins=shared,
        )
        self._report_detections(detector)
        mavutil = SimpleNamespace(
            mavlink_connection=lambda *_: self._link, mavlink=self._link.dialect
        )
        run_module(
            changed(
                REPOSITORY.source(SCRIPT),
                {
                    "takeoff_alt = 5": f"takeoff_alt = {START_HEIGHT_M!r}",
                    "target_pos = [10,-9]": "target_pos = [0.0, 0.0]",
                },
            ),
            name="cuav_landing",
            file=str(REPOSITORY.folder / SCRIPT),
            stand_ins={
                **shared,
                "aruco_calc": detector,
                "pymavlink": module_with("pymavlink", mavutil=mavutil),
                "video_prec_gazebo": module_with("video_prec_gazebo", Cam_stream=self._stream),
            },
        )

    def _stream(self) -> SimpleNamespace:
        return SimpleNamespace(setup=lambda: self.picture, frame_available=lambda: True)

    def _report_detections(self, detector: Any) -> None:
        """Note what the detector finds, for the diagnostics; it is not changed by that."""
        find = detector.aru

        def noted(frame: Any) -> Any:
            found = find(frame)
            if found:
                self.note_sighting(float(found[1]), float(found[0]))
            return found

        detector.aru = noted


class _Link:
    """pymavlink's connection, as far as the script uses it; messages come at the frame rate."""

    TELEMETRY = ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED")
    target_system = target_component = 1

    def __init__(self, autopilot: Autopilot, script: Script, mission: Mission) -> None:
        self._autopilot, self._script = autopilot, script
        self._origin = mission.gps_position_m
        self.unread: set[str] = set()
        self.mav = SimpleNamespace(command_long_send=self._command, send=self._setpoint)
        self.dialect = SimpleNamespace(
            **MAVLINK, MAVLink_set_position_target_local_ned_message=lambda *fields: fields
        )

    def wait_heartbeat(self) -> None:
        """Return at once: the vehicle is there."""

    def motors_armed(self) -> bool:
        """Return that they are: the vehicle hovers."""
        return True

    def recv_match(self, *, type: str, blocking: bool) -> SimpleNamespace | None:  # noqa: A002
        """Return the newest message of a type; one that was read before is waited for.

        The argument has pymavlink's name, with which the script calls it.
        """
        if type == "COMMAND_ACK":
            return SimpleNamespace()
        while type not in self.unread:
            self._script.wait()
        self.unread.discard(type)
        here, (x, y, z) = self._autopilot.global_position, self._autopilot.position_m
        vx, vy, _ = (float(each) for each in self._autopilot.observation.velocity_mps)
        if type == "GLOBAL_POSITION_INT":
            return SimpleNamespace(
                lat=here.lat * 1e7,
                lon=here.lon * 1e7,
                alt=(ELEVATION_M + z) * 1000,
                relative_alt=z * 1000,
                time_boot_ms=self._script.clock.time() * 1000,
            )
        north, east = y - self._origin[1], x - self._origin[0]
        return SimpleNamespace(x=north, y=east, z=-z, vx=vy, vy=vx)

    def _command(self, system: int, component: int, command: int, *_: float) -> None:
        if command == MAVLINK["MAV_CMD_NAV_LAND"]:
            self._autopilot.land()

    def _setpoint(self, fields: tuple[float, ...]) -> None:
        _, _, _, frame, _, north, east, down = fields[:8]
        if frame == MAVLINK["MAV_FRAME_LOCAL_NED"]:
            self._autopilot.go_to((self._origin[0] + east, self._origin[1] + north, -down))
        else:
            x, y = self._autopilot.beside(float(north), float(east))
            self._autopilot.go_to((x, y, self._autopilot.position_m[2] - down))


def _nothing(*_: Any, **__: Any) -> None:
    """Neither log nor catch signals, which a thread cannot."""
