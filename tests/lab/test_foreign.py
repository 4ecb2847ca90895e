"""The adapters of foreign landing systems; the systems are flown if their code is there."""

from __future__ import annotations

import hashlib
import math
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from lab.foreign import legacy_opencv
from lab.foreign.__main__ import flown, row
from lab.foreign.autopilot import CONTROL_RATE_HZ, Autopilot
from lab.foreign.calibration import CalibrationFolder
from lab.foreign.catalogue import SYSTEMS, Foreign
from lab.foreign.loading import changed, module_with, run_module, selected, with_print_calls
from lab.foreign.repository import FOLDER, ForeignCodeError, Repository
from lab.foreign.script import Script
from pytest_garl import Airframe, Camera, Mission, Observation, VehicleState
from pytest_garl.scenarios.files import load

AIRFRAME = Airframe(control_rate_hz=CONTROL_RATE_HZ)
TEXT = "gain = 1\n"


def mission() -> Mission:
    return Mission(
        gps_position_m=(3.0, -2.0),
        home_m=(0.0, 0.0, 0.2),
        search_altitude_m=10.0,
        marker_id=0,
        marker_side_m=1.5,
        marker_dictionary="DICT_5X5_50",
        camera=Camera(),
        time_limit_s=120.0,
    )


def observation(
    position_m: tuple[float, float, float], yaw_rad: float = 0.0, range_m: float | None = None
) -> Observation:
    return Observation(
        time_s=1.0,
        position_m=np.array(position_m),
        velocity_mps=np.zeros(3),
        attitude=np.array([0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)]),
        image=np.zeros((240, 320, 3), np.uint8),
        depth_m=np.zeros((240, 320), np.float32),
        rangefinder_m=range_m,
    )


def autopilot_at(position_m: tuple[float, float, float], yaw_rad: float = 0.0) -> Autopilot:
    autopilot = Autopilot(AIRFRAME, mission())
    autopilot.observe(observation(position_m, yaw_rad, position_m[2]))
    return autopilot


def repository(expected: str = hashlib.sha256(TEXT.encode()).hexdigest()) -> Repository:
    return Repository(name="who/what", commit="c0ffee", licence="MIT", files={"a.py": expected})


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(FOLDER, str(tmp_path))
    folder = tmp_path / "who+what"
    folder.mkdir()
    return folder


def test_missing_code_says_what_to_clone(clone: Path) -> None:
    with pytest.raises(ForeignCodeError, match=r"Clone https://github.com/who/what .* c0ffee"):
        repository().source("a.py")


def test_code_of_another_version_is_refused(clone: Path) -> None:
    (clone / "a.py").write_text("gain = 2\n")
    assert "another version" in repository().problem


def test_expected_code_is_read(clone: Path) -> None:
    (clone / "a.py").write_text(TEXT)
    assert repository().source("a.py") == TEXT


def test_unset_folder_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER, raising=False)
    assert FOLDER in repository().problem


def test_text_to_change_must_be_there_once() -> None:
    assert changed("a = 1; b = 2", {"a = 1": "a = 3"}) == "a = 3; b = 2"
    for source in ("b = 2", "a = 1; a = 1"):
        with pytest.raises(ForeignCodeError, match="expected once"):
            changed(source, {"a = 1": "a = 3"})


def test_print_statements_become_calls() -> None:
    assert with_print_calls('print "a", 1\n').strip() == 'print("a", 1)'


def test_selected_statements_are_kept_with_the_imports() -> None:
    source = "import math\nx = 1\nserver = start()\ndef f():\n    return math.pi\n"
    assert selected(source, ("x", "f")) == ("import math\nx = 1\n\ndef f():\n    return math.pi")


def test_stand_ins_are_seen_by_the_module_alone() -> None:
    arm = module_with("robot.arm", length=2)
    module = run_module(
        "import robot.arm as arm\nfrom robot.arm import length\nimport math\nprint('loud')\n",
        name="m",
        file="m.py",
        stand_ins={"robot": module_with("robot", arm=arm), "robot.arm": arm},
    )
    assert (module.arm, module.length, module.math) == (arm, 2, math)
    assert "robot" not in sys.modules


def test_script_sees_each_frame_once_and_its_clock_is_the_flights() -> None:
    seen: list[float] = []

    def main() -> None:
        while True:
            script.wait()
            seen.append(round(script.clock.time(), 3))

    script = Script(main)
    for time_s in (0.0, 0.1, 0.2):
        script.resume(time_s)
    script.close()
    assert seen == [0.0, 0.1, 0.2]


def test_script_sleeps_through_frames() -> None:
    woken: list[float] = []

    def main() -> None:
        script.time_module.sleep(0.25)
        woken.append(round(script.time_module.time(), 3))

    script = Script(main)
    for time_s in (0.0, 0.1, 0.2, 0.3, 0.4):
        script.resume(time_s)
    assert woken == [0.3]
    assert script.ended


def test_clock_of_a_script_never_stands_still() -> None:
    clock = Script(lambda: None).clock
    assert clock.time() < clock.time()


def test_error_of_a_script_is_raised_by_the_step() -> None:
    def main() -> None:
        raise ZeroDivisionError

    script = Script(main)
    with pytest.raises(ZeroDivisionError):
        script.resume(0.0)
    script.resume(0.1)


def test_old_functions_of_opencv_find_a_marker_and_its_place() -> None:
    camera = Camera(width_px=640, height_px=480)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_ARUCO_ORIGINAL)
    image = np.full((480, 640), 255, np.uint8)
    image[200:264, 350:414] = cv2.aruco.generateImageMarker(dictionary, 72, 64)
    old = legacy_opencv.opencv(SimpleNamespace)
    corners, ids, _ = old.aruco.detectMarkers(
        image=image, dictionary=dictionary, parameters=old.aruco.DetectorParameters_create()
    )
    assert ids.tolist() == [[72]]
    _, shifts, _ = old.aruco.estimatePoseSingleMarkers(corners, 60, camera.matrix, np.zeros(5))
    # 64 px of a focal length of 320 px; the middle is 62 px right and 8 px up of the picture's.
    assert shifts[0, 0] == pytest.approx([58.1, -7.5, 300.0], abs=5.0)
    assert old.aruco.detectMarkers(np.zeros((48, 64), np.uint8), dictionary)[1] is None


def test_calibration_files_hold_the_camera() -> None:
    camera = Camera()
    folder = CalibrationFolder(camera, "raspi")
    matrix = np.loadtxt(f"{folder.prefix}cameraMatrix_raspi.txt", delimiter=",")
    assert (
        np.loadtxt(f"{folder.prefix}cameraDistortion_raspi.txt", delimiter=",").tolist() == [0] * 5
    )
    assert matrix == pytest.approx(camera.matrix)
    folder.close()
    assert not Path(folder.prefix).exists()


def test_global_position_and_back_is_the_same_place() -> None:
    autopilot = autopilot_at((5.0, 4.0, 8.0))
    assert autopilot.place_of(autopilot.global_position) == pytest.approx((5.0, 4.0, 8.0))


@pytest.mark.parametrize(
    ("yaw_deg", "heading_deg", "ahead"),
    [(0.0, 90.0, (2.0, -1.0)), (90.0, 0.0, (1.0, 2.0)), (180.0, -90.0, (-2.0, 1.0))],
)
def test_heading_is_clockwise_from_north(
    yaw_deg: float, heading_deg: float, ahead: tuple[float, float]
) -> None:
    autopilot = autopilot_at((0.0, 0.0, 8.0), math.radians(yaw_deg))
    assert math.degrees(autopilot.heading_rad) == pytest.approx(heading_deg)
    assert autopilot.beside(2.0, 1.0) == pytest.approx(ahead)


def test_landing_target_lies_where_its_angles_say() -> None:
    autopilot = autopilot_at((1.0, 1.0, 10.0), math.pi / 2)
    message: dict[str, Any] = {"frame": {"type": "MAV_FRAME_LOCAL_FRD"}}
    autopilot.landing_target({**message, "angle_x": math.atan(0.1), "angle_y": math.atan(-0.2)})
    # The nose points north: 2 m ahead, 1 m to the right.
    assert autopilot.target_m == pytest.approx((2.0, 3.0, 0.0))


def test_landing_target_without_a_range_is_of_no_use() -> None:
    autopilot = Autopilot(AIRFRAME, mission())
    autopilot.observe(observation((0.0, 0.0, 10.0)))
    frame = {"type": "MAV_FRAME_LOCAL_FRD"}
    autopilot.landing_target({"frame": frame, "angle_x": 0.0, "angle_y": 0.0})
    assert autopilot.target_m is None


def test_autopilot_takes_over_in_the_air_without_a_jolt() -> None:
    autopilot = autopilot_at((0.0, 0.0, 8.0))
    state = VehicleState(
        time_s=1.0,
        position_m=(0.0, 0.0, 8.0),
        velocity_mps=(0.0, 0.0, 0.0),
        attitude=(0.0, 0.0, 0.0, 1.0),
        angular_velocity_radps=(0.0, 0.0, 0.0),
        thrusts_n=(0.0, 0.0, 0.0, 0.0),
    )
    assert sum(autopilot.control(state).newtons) == pytest.approx(2.355 * 9.80665, rel=0.02)


def test_land_ends_guided() -> None:
    autopilot = autopilot_at((0.0, 0.0, 8.0))
    autopilot.land()
    autopilot.go_to((9.0, 9.0, 9.0))
    assert type(autopilot.command(())).__name__ == "Land"


@pytest.mark.sim
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")  # scripts that use np.matrix
@pytest.mark.parametrize("foreign", SYSTEMS, ids=lambda foreign: foreign.name)
def test_foreign_system_lands_above_its_marker(foreign: Foreign) -> None:
    if foreign.repository.problem:
        pytest.skip(foreign.repository.problem)
    if foreign.name == "blueos":
        pytest.importorskip("apriltag")
    assert "| good |" in row(foreign, "court", 0.0)


REPORTED = {
    "cuav-beside": "off:unseen",
    "cuav-other-marker": "late:not-landed:approach",
    "cuav-wind": "off:seen",
    "how-other-marker": "late:not-landed:descent",
}
"""Scenarios of docs/foreign-systems.md."""


@pytest.mark.sim
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")  # scripts that use np.matrix
@pytest.mark.parametrize("name", REPORTED)
def test_scenario_of_a_bug_report_shows_the_bug(name: str) -> None:
    file = Path("lab/foreign/scenarios") / f"{name}.toml"
    scenario = load(file)
    foreign = next(each for each in SYSTEMS if each.name.startswith(name.partition("-")[0]))
    assert scenario.task == foreign.task
    if foreign.repository.problem:
        pytest.skip(foreign.repository.problem)
    assert flown(foreign, scenario)[1].signature == REPORTED[name]
