"""The foreign systems: each a companion program, with the settings that fit the simulated UAV.

What stands in a call of ``adapted`` is the whole adapter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.foreign.repository import Changes, Repository, clones
from pytest_garl import (
    Airframe,
    ArduCopter,
    Camera,
    CompanionProgram,
    ExternalProgram,
    Rangefinder,
    Start,
    external,
)
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.scenarios.task import Task

HERE = str(Path(__file__).parent)
CLIENTS = str(Path(external.__file__).with_name("clients"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Foreign:
    """One landing system of somebody else, and the task that it is given."""

    name: str
    system: CompanionProgram | ExternalProgram
    repository: Repository
    task: Task
    python: Path

    @property
    def problem(self) -> str:
        """What is missing to fly it; empty if nothing is."""
        no_python = (
            f"{self.python}: no such file; docs/results/foreign-systems.md says what it needs"
        )
        return self.repository.problem or ("" if self.python.is_file() else no_python)


def adapted(
    name: str,
    repository: Repository,
    command: str,
    *,
    marker: MarkerSpec,
    start: Start | None = None,
    changes: Changes | None = None,
    environment: dict[str, str] | None = None,
    **vehicle: Any,
) -> Foreign:
    """Return a foreign system: a program of its clone, in the Python beside the clones."""
    python = clones() / "venv/bin/python"
    system = CompanionProgram(
        command,
        name=name.replace("-", "_"),
        folder=repository.prepared(changes or {}),
        python=python,
        windows="ignore",
        environment=environment,
        **vehicle,
    )
    task = Task(marker=marker, start=start or Start())
    return Foreign(name=name, system=system, repository=repository, task=task, python=python)


def over_ros(
    name: str,
    repository: Repository,
    *nodes: str,
    camera: Camera,
    marker: MarkerSpec,
    start: Start,
) -> Foreign:
    """Return nodes of ROS 2 as a foreign system, with ``px4_face.py`` as their vehicle."""
    python = clones() / "ros/bin/python"
    system = ExternalProgram(
        [str(python), f"{HERE}/px4_face.py", *nodes],
        name=name.replace("-", "_"),
        folder=repository.prepared({}),
        airframe=Airframe(camera=camera),
        environment={"PYTHONPATH": f"{CLIENTS}:{HERE}"},
    )
    task = Task(marker=marker, start=start)
    return Foreign(name=name, system=system, repository=repository, task=task, python=python)


def calibration(camera: Camera, name: str = "") -> dict[str, str]:
    """Return the two calibration files of a camera, as many scripts read them."""
    rows = "\n".join(",".join(map(repr, map(float, row))) for row in camera.matrix)
    distortion = ",".join(map(repr, camera.distortion or (0.0,) * 5))
    end = f"_{name}.txt" if name else ".txt"
    return {f"cameraMatrix{end}": rows, f"cameraDistortion{end}": distortion}


def _in(folder: str, files: dict[str, str]) -> dict[str, str]:
    return {f"{folder}/{name}": text for name, text in files.items()}


RASPI = Camera(width_px=960, height_px=720)
WEBCAM = Camera(width_px=640, height_px=480)
PI_CAMERA = Camera(width_px=640, height_px=480, field_of_view_rad=math.radians(62.2))
PHONE = Camera(width_px=640, height_px=480, field_of_view_rad=1.1252)
"""That of the calibration in the repository, without its distortion."""
SQUARE = Camera(width_px=480, height_px=480, field_of_view_rad=2 * math.atan(0.5), rate_hz=20)
"""Its focal length is its width, which the node takes for granted."""
SIYI = Camera(width_px=640, height_px=360, field_of_view_rad=math.radians(81))

SYSTEMS = (
    adapted(
        "how-do-drones-work",
        Repository(
            name="tizianofiorenzani/how_do_drones_work",
            commit="243547be80fa18ccc4c904fd7175ba8dea4613d4",
            licence="BSD-3-Clause",
            paths=("scripts/06_precise_landing.py", "opencv"),
            python2=("scripts/06_precise_landing.py", "opencv/lib_aruco_pose.py"),
        ),
        "python scripts/06_precise_landing.py --connect udp:0.0.0.0:14550",
        camera=RASPI,
        marker=MarkerSpec(dictionary="DICT_ARUCO_ORIGINAL", id=72, side_m=0.4),
        start=Start(mode="hover", height_m=8.0),
        changes={
            "scripts/06_precise_landing.py": {"marker_size     = 10 ": "marker_size     = 40 "},
            **_in("opencv", calibration(RASPI, "raspi")),
        },
    ),
    adapted(
        "blueos",
        Repository(
            name="BlueOS-community/blueos-precision-landing",
            commit="fef6a58bd255cf34d37e6da5854eda7363517dc7",
            licence="GPL-3.0",
            paths=("app",),
        ),
        "python serve.py",
        airframe=Airframe(camera=SIYI, rangefinder=Rangefinder()),
        vehicle=ArduCopter(pilot="LAND", parameters={"PLND_ENABLED": 1}),
        marker=MarkerSpec(dictionary="DICT_APRILTAG_36h11", id=7, side_m=1.0),
        start=Start(mode="hover", height_m=15.0),
        environment={"PYTHONPATH": HERE},
        changes={
            "serve.py": "import mavlink2rest as m, uvicorn; m.serve(); uvicorn.run('app.main:app')",
            "app/main.py": {"Path('/app/logs')": "Path('/tmp')"},
            "app/settings.py": {"'/app/settings/precision-landing-settings.json'": "'saved.json'"},
            "saved.json": '{"precision_landing": {"enabled": true}, "apriltag": {"target_id": 7}}',
        },
    ),
    adapted(
        "cuav-landing",
        Repository(
            name="snktshrma/precision-landing",
            commit="49aee46bda00371960ee9a8a1f5b9b842b0765a0",
            licence="MIT",
            paths=("python_sim/cuav_landing.py", "python_sim/aruco_calc.py"),
        ),
        "python python_sim/cuav_landing.py",
        camera=WEBCAM,
        marker=MarkerSpec(dictionary="DICT_6X6_250", id=1, side_m=1.5),
        start=Start(mode="hover", height_m=10.0),
        environment={"PYTHONPATH": HERE},
        changes={
            "python_sim/cuav_landing.py": {
                "takeoff_alt = 5": "takeoff_alt = 10",
                "[10,-9]": "[0, 0]",
                "abs((globalPos[2]/100 - 1)": "abs(globalPos[3]",
            },
            "python_sim/aruco_calc.py": {"58.5937500001": "150"},
            "python_sim/tf.py": "",
            "python_sim/video_prec_gazebo.py": "from latest_frame import LatestFrame as Cam_stream",
            **calibration(WEBCAM, "webcam"),
        },
    ),
    adapted(
        "khairul-single",
        Repository(
            name="khairul-me/Autonomous-Drone-Delivery-and-Precision-Landing",
            commit="b4094ad7b5f758016843226d8514fb5206a6d6eb",
            licence="none",
            paths=("precision_landing_single_aruco.py",),
        ),
        "python precision_landing_single_aruco.py",
        airframe=Airframe(camera=PI_CAMERA, rangefinder=Rangefinder()),
        marker=MarkerSpec(dictionary="DICT_ARUCO_ORIGINAL", id=72, side_m=0.4),
        start=Start(mode="hover", height_m=8.0),
        changes={
            "precision_landing_single_aruco.py": {
                "/home/pi/video2calibration/calibrationFiles/": "",
                "width=self.horizontal_res, \n": "\n",
                "height=self.vertical_res)": ")",
            },
            **calibration(PI_CAMERA),
        },
    ),
    adapted(
        "pandya-camera2",
        Repository(
            name="Pandya16/Precision-Landing",
            commit="4be60aa1eda182263ad3e4a8800419320fe10b28",
            licence="none",
            paths=("camera2.py", "cameraMatrix.pkl", "dist.pkl"),
        ),
        "python camera2.py",
        camera=PHONE,
        vehicle=ArduCopter(pilot="LAND", parameters={"PLND_ENABLED": 1}),
        marker=MarkerSpec(dictionary="DICT_6X6_250", id=23, side_m=0.5),
        changes={"camera2.py": {"MARKER_SIZE = 0.20": "MARKER_SIZE = 0.50"}},
    ),
    over_ros(
        "kyujin-precision-land",
        Repository(
            name="kyujin1/ArUco-Marker-Precision-Landing-and-Hovering",
            commit="98d42f3e486e1dbe3939d187054b53dfe0250f61",
            licence="none",
            paths=("vtol/vtol/cam_node.py", "vtol/vtol/precision_land.py"),
        ),
        "vtol/vtol/cam_node.py",
        "vtol/vtol/precision_land.py",
        camera=SQUARE,
        marker=MarkerSpec(dictionary="DICT_6X6_250", id=1, side_m=1.5),
        start=Start(mode="hover", height_m=10.0),
    ),
)
