"""A companion program and its autopilot: what goes between them, and what goes wrong."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_garl.airframe import Airframe, Camera, Rangefinder
from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.errors import LandingSystemError
from pytest_garl.landing_system import Command, Land, Observation, VehicleState
from pytest_garl.program import ProgramFailedError
from pytest_garl.simulation.fly import fly
from pytest_garl.vehicle.autopilot import ArduCopter
from tests.companion.processes import CAMERA, board_picture, mission, script
from tests.support.flights import EMPTY, STAND, nominal

HEADER = """
import time
from pymavlink import mavutil
mav = mavutil.mavlink
link = mavutil.mavlink_connection("udp:0.0.0.0:14550")
link.wait_heartbeat()
"""


def program(folder: Path, text: str, command: str = "python lander.py", **given: Any) -> Any:
    script(folder, text)
    return CompanionProgram(command, folder=folder, **{"camera": CAMERA, **given})


def fly_still(
    flown: CompanionProgram, seconds: float, *, height_m: float = 0.2, picture: Any = None
) -> list[Command]:
    """Fly a program whose vehicle stays where it is, whatever it commands."""
    flight = flown()
    image = np.zeros((CAMERA.height_px, CAMERA.width_px, 3), np.uint8)
    commands = []
    place = (1.0, 2.0, height_m)
    try:
        flight.reset(mission())
        for tick in range(round(seconds * 240)):
            if tick % 24 == 0:
                observation = Observation(
                    time_s=tick / 240,
                    position_m=np.array(place),
                    velocity_mps=np.zeros(3),
                    attitude=np.array((0.0, 0.0, 0.0, 1.0)),
                    image=image if picture is None else picture,
                    depth_m=np.zeros(image.shape[:2], np.float32),
                    rangefinder_m=height_m,
                )
                commands.append(flight.step(observation))
            flight.control(
                VehicleState(
                    time_s=tick / 240,
                    position_m=place,
                    velocity_mps=(0.0, 0.0, 0.0),
                    attitude=(0.0, 0.0, 0.0, 1.0),
                    angular_velocity_radps=(0.0, 0.0, 0.0),
                    thrusts_n=(0.0, 0.0, 0.0, 0.0),
                )
            )
    finally:
        flight.close()
    return commands


def notes(commands: list[Command]) -> str:
    return "\n".join(each.diagnostics.note for each in commands if each.diagnostics)


def test_mission_facts_fill_the_command_and_prints_become_notes(tmp_path: Path) -> None:
    text = "import sys\nprint(sys.argv[1:])\nimport logging\nlogging.warning('logged')\n"
    words = "python lander.py {marker_id} {north_m} {east_m} {width_px} {lat_deg} '{\"a\": 1}'"
    commands = fly_still(program(tmp_path, text, words), 0.3)
    assert "['7', '3.000', '9.000', '32', '47.0000449', '{\"a\": 1}']" in notes(commands)
    assert "WARNING:root:logged" in notes(commands)
    assert notes(commands).count("the program has ended") == 1


def test_real_mavutil_arms_reads_the_state_and_sets_parameters(tmp_path: Path) -> None:
    text = f"""{HEADER}
link.mav.param_set_send(1, 1, b"LAND_SPEED", 30, mav.MAV_PARAM_TYPE_REAL32)
value = link.recv_match(type="PARAM_VALUE", blocking=True)
print(value.param_id, value.param_value)
link.set_mode("GUIDED")
link.arducopter_arm()
link.motors_armed_wait()
print(link.flightmode, link.messages["COMMAND_ACK"].result)
here = link.recv_match(type="LOCAL_POSITION_NED", blocking=True)
globe = link.recv_match(type="GLOBAL_POSITION_INT", blocking=True)
print(here.x, here.y, here.z, globe.relative_alt, globe.hdg)
print(link.recv_match(type="DISTANCE_SENSOR", blocking=True).current_distance)
"""
    flown = program(tmp_path, text, airframe=Airframe(rangefinder=Rangefinder()))
    said = notes(fly_still(flown, 4.0))
    assert "LAND_SPEED 30.0" in said
    assert "GUIDED 0" in said
    assert "0.0 0.0 -0.0 0 9000" in said
    assert "\n20" in said


@pytest.mark.parametrize(
    "connection",
    ["udpin:0.0.0.0:14551", "udpout:10.0.0.2:14550", "tcp:127.0.0.1:5762", "/dev/ttyACM0"],
)
def test_real_mavutil_connects_by_udp_tcp_and_a_serial_port(
    tmp_path: Path, connection: str
) -> None:
    text = f"""
from pymavlink import mavutil
link = mavutil.mavlink_connection({connection!r}, baud=57600)
link.mav.heartbeat_send(18, 8, 0, 0, 0)
link.wait_heartbeat()
link.set_mode("GUIDED")
print(link.target_system, link.recv_match(type="COMMAND_ACK", blocking=True).result)
"""
    assert "1 0" in notes(fly_still(program(tmp_path, text), 2.0))


def test_a_landing_target_and_a_marker_in_its_detector_are_diagnostics(tmp_path: Path) -> None:
    text = f"""{HEADER}
import cv2
camera = cv2.VideoCapture(0)
detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
while True:
    detector.detectMarkers(cv2.resize(camera.read()[1], (256, 192)))
    link.mav.landing_target_send(0, 0, mav.MAV_FRAME_BODY_FRD, 0.1, 0.0, 10.0, 0.0, 0.0)
"""
    commands = fly_still(program(tmp_path, text), 3.0, height_m=10.2, picture=board_picture())
    told = commands[-1].diagnostics
    assert told is not None
    assert told.phase == "GUIDED"
    assert told.note == "seen by its detector: 3"
    (seen,) = told.detections
    assert seen.marker_id == 3
    assert seen.corners_px[0] == pytest.approx((8, 4), abs=0.5)
    # The marker's middle is half a pixel right of, and above, the middle of a picture of 32 x 24.
    assert seen.position_m == pytest.approx((1.0, 2.0, 0.0), abs=0.8)
    # 0.1 rad to the right of a vehicle that faces east is south of it.
    assert told.target_m == pytest.approx((1.0, 2.0 - 10 * np.sin(0.1), 0.25), abs=0.02)


WAITS = "import time\ntime.sleep(100)\n"
FAILURES: dict[str, tuple[str, str, str]] = {
    "exits": ("import sys; sys.exit(3)", "exit-status-3", "ended with exit status 3 at 0.0 s"),
    "exits hard": ("import os; os._exit(4)", "exit-status-4", "ended in the flight with exit sta"),
    "exits late": ("import time, os\ntime.sleep(0.5)\nos._exit(0)", "exit-status-0", "ended in t"),
    "kills itself": ("import os; os.kill(os.getpid(), 9)", "signal-9", "signal 9 (SIGKILL)"),
    "kills its group": ("import os; os.killpg(0, 9)", "signal-9", "SIGKILL"),
    "segfaults": ("import ctypes; ctypes.string_at(0)", "signal-11", "SIGSEGV), at File"),
    "raises": ("x = {}\nx['id']", "KeyError", "'id' (lander.py, line 2)"),
    "raises a text of 9 MB": ("raise ValueError('x' * 9_000_000)", "ValueError", "xxx"),
    "does not parse": ("def f(:", "SyntaxError", "lander.py"),
    "wants a package": ("import picamera2", "ModuleNotFoundError", "install it for"),
    "forks": ("import os; os.fork()", "RuntimeError", "the program calls os.fork"),
    "starts processes": (
        "import multiprocessing as m\nm.get_context('fork').Process(target=print).start()",
        "RuntimeError",
        "use threading.Thread, or subprocess (lander.py, line 2)",
    ),
    "opens a window": ("import cv2; cv2.namedWindow('x')", "RuntimeError", "no display"),
    "writes into the link": (
        "import os\nfor fd in range(3, 500):\n    try: os.write(fd, b'garbage' * 99)\n"
        "    except OSError: pass",
        "BadMessage",
        "wrote into the link",
    ),
    "closes all files": ("import os; os.closerange(0, 99)\nimport time; time.sleep(9)", "", ""),
    "recurses": ("def f(): f()\nf()", "RecursionError", "maximum recursion depth"),
    "sends NaN": (
        f"{HEADER}\nlink.mav.set_position_target_local_ned_send(0, 1, 1, 1, 0xDF8, float('nan'), "
        "0, 0, 0, 0, 0, 0, 0, 0, 0, 0)\ntime.sleep(9)",
        "BadMessage",
        "SET_POSITION_TARGET_LOCAL_NED with x = nan; expected a finite number (lander.py, line ",
    ),
}


@pytest.mark.parametrize("case", FAILURES)
def test_a_program_that_fails_is_a_finding_with_one_clear_message(
    tmp_path: Path, case: str
) -> None:
    text, error, message = FAILURES[case]
    with pytest.raises(ProgramFailedError) as caught:
        fly_still(program(tmp_path, text), 3.0)
    if error:
        assert caught.value.error == error
        assert message in str(caught.value)


HARMLESS = {
    "floods": "import os\nfor _ in range(3_000):\n    os.write(1, bytes(1000)); print('x' * 99)",
    "patches its clock": "import time\ntime.sleep = lambda s: None\ntime.time = lambda: 0.0",
    "leaves a thread": "import threading\nthreading.Thread(target=threading.Event().wait).start()",
    "leaves a process": "import subprocess\nsubprocess.Popen(['sleep', '100'])",
    "ends at once": "",
    "raises in a thread": "import threading\nthreading.Thread(target=lambda: 1 / 0).start()",
}


@pytest.mark.parametrize("case", HARMLESS)
def test_a_program_that_misbehaves_without_harm_flies_on(tmp_path: Path, case: str) -> None:
    commands = fly_still(program(tmp_path, HARMLESS[case]), 0.5)
    assert len(commands) == 5
    if case == "raises in a thread":
        assert "ZeroDivisionError" in notes(commands)


def test_a_program_that_opens_no_link_is_told_so(tmp_path: Path) -> None:
    with pytest.raises(ProgramFailedError, match="has opened no link to the vehicle after 30 s"):
        fly_still(program(tmp_path, WAITS), 31.0)


def test_a_program_that_says_nothing_to_a_vehicle_on_the_ground_is_told_so(tmp_path: Path) -> None:
    with pytest.raises(ProgramFailedError, match="has sent the vehicle nothing after 30 s, and it"):
        fly_still(program(tmp_path, f"{HEADER}\ntime.sleep(99)\n"), 31.0)
    waits = ArduCopter(pilot="LOITER")
    fly_still(program(tmp_path, f"{HEADER}\ntime.sleep(99)\n", vehicle=waits), 30.5)


def test_nothing_of_a_program_is_left_after_its_flight(tmp_path: Path) -> None:
    text = """
        import os, subprocess, time
        child = subprocess.Popen(["sleep", "100"])
        daemon = "sleep 100 >/dev/null 2>&1 & echo $!"
        daemon = subprocess.run(["setsid", "sh", "-c", daemon], stdout=subprocess.PIPE)
        print("left", os.getpid(), child.pid, daemon.stdout.decode())
        time.sleep(100)
    """
    said = notes(fly_still(program(tmp_path, text), 0.3))
    _, *pids = said.split()
    assert all(_is_gone(pid) for pid in pids[:3])


def _is_gone(pid: str) -> bool:
    """Whether a process is gone, or waits for whoever adopted it to take its status."""
    stat = Path("/proc", pid, "stat")
    for _ in range(100):
        if not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z":
            return True
        time.sleep(0.02)
    return False


def _old_python(folder: Path) -> str:
    file = script(folder, "#!/bin/sh\necho 3.8\n", "python3.8")
    file.chmod(0o755)
    return str(file)


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "no text": (lambda folder: CompanionProgram("", folder=folder), "the line that starts"),
    "a quote": (lambda folder: CompanionProgram("python 'a", folder=folder), "No closing quot"),
    "another language": (lambda folder: CompanionProgram("./lander"), "an ExternalProgram"),
    "windows": (lambda folder: program(folder, "", windows="show"), "expected refuse, ignore"),
    "parameter": (
        lambda folder: ArduCopter(parameters={"LAND_SPED": 1}),
        "found 'LAND_SPED', which nothing here reads; did you mean LAND_SPEED",
    ),
    "value": (lambda folder: ArduCopter(parameters={"PLND_STRICT": 5}), "expected 0, 1 or 2"),
    "nan": (lambda folder: ArduCopter(parameters={"RTL_ALT": float("nan")}), "finite number"),
    "pilot": (lambda folder: ArduCopter(pilot="AUTO"), "expected 'LAND'"),  # type: ignore[arg-type]
    "no script": (
        lambda folder: CompanionProgram("python gone.py", folder=folder).check(),
        "there is no file 'gone.py' in",
    ),
    "no python": (
        lambda folder: program(folder, "", python="venv/bin/python").check(),
        "there is no Python 'venv/bin/python'",
    ),
    "no Python": (
        lambda folder: program(folder, "", python="/bin/ls").check(),
        "there is no Python '/bin/ls'; expected 3.9 or later",
    ),
    "an old Python": (
        lambda folder: program(folder, "", python=_old_python(folder)).check(),
        "found Python 3.8 as",
    ),
    "vehicle": (
        lambda folder: program(folder, "", vehicle="copter"),
        "(vehicle='copter'): expected ArduCopter(...) or",
    ),
    "brace": (
        lambda folder: program(folder, "", "python lander.py {marker}").check(),
        "found {marker}, expected one of",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_flown_is_refused_with_what_was_expected(tmp_path: Path, case: str) -> None:
    make, message = BAD[case]
    with pytest.raises(LandingSystemError) as caught:
        make(tmp_path)
    assert message in str(caught.value)


def test_what_decides_how_it_flies_is_among_its_sources(tmp_path: Path) -> None:
    plain = program(tmp_path, "").source_hashes()
    assert plain["lander.py"]
    slow = program(tmp_path, "", vehicle=ArduCopter(parameters={"LAND_SPEED": 20}))
    wide = program(tmp_path, "", camera=Camera(width_px=640))
    for other in (slow, wide):
        found = other.source_hashes()
        assert [name for name in found if found[name] != plain[name]] == ["the settings of lander"]


def test_a_landed_vehicle_says_land(tmp_path: Path) -> None:
    text = f"{HEADER}\nlink.set_mode('LAND')\n"
    commands = fly_still(program(tmp_path, text), 3.0, height_m=5.0)
    assert isinstance(commands[-1], Land)


@pytest.mark.sim
@pytest.mark.parametrize(
    ("afterwards", "outcome", "said_s"),
    [("", "gave_up", [3.0]), ('time.sleep(2)\nlink.set_mode("GUIDED")\n', "not_landed", [])],
)
def test_a_return_home_that_lasts_to_the_end_was_given_up_when_it_was_commanded(
    tmp_path: Path, afterwards: str, outcome: str, said_s: list[float]
) -> None:
    begins = """
link.set_mode("GUIDED")
link.arducopter_arm()
link.mav.command_long_send(1, 1, mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 0, 6)
while link.recv_match(type="LOCAL_POSITION_NED", blocking=True).time_boot_ms < 33_000:
    pass
link.set_mode("RTL")
"""
    flown = program(tmp_path, f"{HEADER}{begins}{afterwards}time.sleep(99)\n")
    flight = fly(nominal(), flown, STAND, map=EMPTY, time_limit_s=8.0)
    assert flight.outcome == outcome
    events = [each for each in flight.events if each.name == "abort_command"]
    assert [each.time_s for each in events] == pytest.approx(said_s, abs=0.2)
    assert [each.time_s for each in flight.events] == sorted(each.time_s for each in flight.events)
