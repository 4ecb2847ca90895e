"""OpenCV in a companion program: its camera, its windows, its ArUco functions."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.companion.processes import board_picture, gradient, running, script


@pytest.mark.parametrize("source", ["0", "'rtsp://camera/stream'", "'v4l2src ! appsink', 1800"])
def test_any_capture_shows_each_frame_once(tmp_path: Path, source: str) -> None:
    text = f"""
        import time
        import cv2
        capture = cv2.VideoCapture({source})
        print(capture.isOpened(), capture.get(cv2.CAP_PROP_FRAME_WIDTH), capture.set(5, 30))
        for _ in range(3):
            ok, image = capture.read()
            print(ok, image.shape, image[5, 0], "%.1f" % time.monotonic())
        print(capture.grab(), capture.retrieve()[0])
        capture.release()
        print(capture.read())
    """
    with running(tmp_path, text) as simulator:
        simulator.picture = gradient
        simulator.fly(0.5, frames=True)
        assert simulator.failure == ""
        assert simulator.printed.splitlines() == [
            "True 32.0 False",
            "True (24, 32, 3) [5 0 0] 0.0",
            "True (24, 32, 3) [5 0 0] 0.1",
            "True (24, 32, 3) [5 0 0] 0.2",
            "True True",
            "(False, None)",
        ]


NEW = "cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(large)"
OLD = "cv2.aruco.detectMarkers(large, dictionary, parameters=parameters)"


@pytest.mark.parametrize("call", [NEW, OLD], ids=["class", "function"])
def test_markers_that_its_detector_returns_are_told_in_pixels_of_the_camera(
    tmp_path: Path, call: str
) -> None:
    text = f"""
        import cv2
        import numpy as np
        image = cv2.VideoCapture(0).read()[1]
        large = cv2.resize(image, None, fx=8, fy=8, interpolation=cv2.INTER_NEAREST)
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        parameters = cv2.aruco.DetectorParameters_create()
        corners, ids, _ = {call}
        print(ids.ravel(), len(corners))
        matrix = np.array([[128.0, 0, 128], [0, 128, 96], [0, 0, 1]])
        turns, shifts, *_ = cv2.aruco.estimatePoseSingleMarkers(corners, 1.0, matrix, None)
        print(np.round(shifts[0, 0, 2]))
    """
    with running(tmp_path, text) as simulator:
        simulator.picture = lambda: board_picture().tobytes()
        simulator.fly(0.1, frames=True)
        assert simulator.failure == ""
        assert simulator.printed == "[3] 1\n1.0\n"
        ((number, corners),) = simulator.found
    assert number == 3
    assert corners[0] == pytest.approx((8, 4), abs=0.3)
    assert corners[2] == pytest.approx((24, 20), abs=0.3)


def test_detectors_that_are_made_for_each_picture_leave_pythons_memory_whole(
    tmp_path: Path,
) -> None:
    text = """
        import cv2
        import numpy as np
        image = np.zeros((48, 64), np.uint8)
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        kept = []
        for number in range(300):
            cv2.aruco.detectMarkers(image, dictionary)
            cv2.aruco.ArucoDetector(dictionary)
            kept.append({"number": number, "texts": [str(each) for each in range(50)]})
        print(sum(len(each["texts"]) for each in kept))
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(0.1).printed == "15000\n"


def test_tags_that_a_detector_of_apriltags_returns_are_told(tmp_path: Path) -> None:
    module = """
        import numpy as np
        class Tag:
            tag_id, corners = 7, np.array([[16, 8], [48, 8], [48, 40], [16, 40]])
        class Detector:
            def detect(self, image):
                return [Tag()]
    """
    script(tmp_path, module, "apriltag.py")
    text = """
        import apriltag
        import numpy as np
        print(len(apriltag.Detector().detect(np.zeros((48, 64), np.uint8))))
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(0.1).printed == "1\n"
        assert simulator.found == [(7, [(8, 4), (24, 4), (24, 20), (8, 20)])]


def test_a_program_that_looks_for_opencv_before_its_import_has_the_camera(tmp_path: Path) -> None:
    text = """
        import importlib.util
        assert importlib.util.find_spec("cv2") is not None
        import cv2
        print(cv2.VideoCapture(0).getBackendName())
    """
    with running(tmp_path, text) as simulator:
        assert simulator.fly(0.1).printed == "GARL\n"


def test_a_window_is_refused_or_ignored(tmp_path: Path) -> None:
    text = """
        import cv2, time
        import numpy as np
        cv2.imshow("view", np.zeros((2, 2)))
        print(cv2.waitKey(30), "%.2f" % time.monotonic())
        cv2.destroyAllWindows()
    """
    with running(tmp_path, text) as simulator:
        simulator.fly(0.1)
        assert "opens a window, and a flight has no display" in simulator.failure
        assert "windows='ignore'" in simulator.failure
    with running(tmp_path, text, windows="ignore") as simulator:
        assert simulator.fly(0.2).printed == "-1 0.03\n"


def test_a_program_that_never_reads_its_camera_is_sent_no_picture(tmp_path: Path) -> None:
    def never() -> bytes:
        raise AssertionError("it asked for a picture")

    with running(tmp_path, "import time\ntime.sleep(0.2)\nprint('done')\n") as simulator:
        simulator.picture = never
        assert simulator.fly(0.4, frames=True).printed == "done\n"


def test_another_python_runs_it_without_pytest_garl(tmp_path: Path) -> None:
    text = "import sys\nprint('pytest_garl' in sys.modules, sys.flags.isolated)\n"
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nexec {sys.executable} -I "$@"\n')
    python.chmod(0o755)
    with running(tmp_path, text, python=str(python)) as simulator:
        assert simulator.fly(0.1).printed == "False 1\n"
