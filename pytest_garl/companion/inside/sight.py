"""OpenCV for a program: its camera is the flight's, and what its detector finds is told.

The ArUco functions of OpenCV 4.6 and before, which version 5 has no more, are there too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .turns import Task, Turns

Found = tuple[int, list[list[float]]]


class Sight:
    """The flight's camera; ``ask`` gets the newest frame from the simulator.

    ``found`` are the markers that the program's detectors returned since it was emptied.
    """

    def __init__(self, turns: Turns, ask: Callable[[], Any], settings: dict[str, Any]) -> None:
        self.turns, self._ask, self.settings = turns, ask, settings
        self.number = 0
        """Of the newest frame; 0 before the first."""
        self.waiting: list[Task] = []
        self.found: list[Found] = []
        self._frame: Any = None
        self._had = 0

    def arrived(self, number: int) -> None:
        """Note that there is a frame."""
        if number > self.number:
            self.number = number
            waiting, self.waiting = self.waiting, []
            for task in waiting:
                self.turns.rouse(task)

    def frame_after(self, number: int) -> tuple[int, Any]:
        """Wait for a frame that is newer than ``number``; return its number and a picture (BGR)."""
        while self.number <= number:
            self.waiting.append(self.turns.current)
            self.turns.park(None)
        return self.number, self.newest().copy()

    def newest(self) -> Any:
        """Return the newest frame; the simulator is asked for it once."""
        if self._had != self.number:
            self._frame, self._had = self._ask(), self.number
        return self._frame

    def tell(self, ids: Any, corners: Any, image: Any) -> None:
        """Note the markers that a detector returned for a picture."""
        if ids is None or not len(corners):
            return
        wide = self.settings["width_px"] / image.shape[1]
        high = self.settings["height_px"] / image.shape[0]
        numbers = [int(each) for each in (ids.ravel() if hasattr(ids, "ravel") else ids)]
        for number, quad in zip(numbers, corners):
            points = [[float(u) * wide, float(v) * high] for u, v in quad.reshape(-1, 2)[:4]]
            self.found.append((number, points))


def change_cv2(cv2: Any, sight: Sight) -> None:
    """Give OpenCV the flight's camera, no windows, and the old ArUco functions."""
    cv2.setNumThreads(1)
    cv2.setRNGSeed(0)

    class VideoCapture:
        """The flight's camera, by whatever index, file, URL or text for GStreamer."""

        def __init__(self, *_: Any, **__: Any) -> None:
            self._opened, self._last, self._grabbed = True, 0, None

        def open(self, *_: Any, **__: Any) -> bool:
            self._opened = True
            return True

        def isOpened(self) -> bool:
            return self._opened

        def grab(self) -> bool:
            if self._opened:
                self._last, self._grabbed = sight.frame_after(self._last)
            return self._opened

        def retrieve(self, *_: Any) -> tuple[bool, Any]:
            return self._grabbed is not None, self._grabbed

        def read(self, *_: Any) -> tuple[bool, Any]:
            return (True, self._grabbed) if self.grab() else (False, None)

        def get(self, key: int) -> float:
            known = {
                cv2.CAP_PROP_FRAME_WIDTH: sight.settings["width_px"],
                cv2.CAP_PROP_FRAME_HEIGHT: sight.settings["height_px"],
                cv2.CAP_PROP_FPS: sight.settings["rate_hz"],
            }
            return float(known.get(key, 0.0))

        def set(self, key: int, value: float) -> bool:
            return bool(self.get(key) == value)

        def getBackendName(self) -> str:
            return "GARL"

        def release(self) -> None:
            self._opened = False

    cv2.VideoCapture = VideoCapture
    _change_windows(cv2, sight)
    if hasattr(cv2, "aruco"):
        _change_aruco(cv2, cv2.aruco, sight)


def _change_windows(cv2: Any, sight: Sight) -> None:
    shown = sight.settings["windows"] == "ignore"

    def window(*_: Any, **__: Any) -> None:
        if not shown:
            raise RuntimeError(
                "the program opens a window, and a flight has no display; switch its windows off, "
                "or give CompanionProgram(..., windows='ignore')"
            )

    def wait_key(delay: int = 0, *_: Any) -> int:
        sight.turns.park(sight.turns.now_s + max(delay, 1) / 1000)
        return -1

    for name in ("imshow", "namedWindow", "createTrackbar", "selectROI"):
        setattr(cv2, name, window)
    for name in ("moveWindow", "resizeWindow", "setMouseCallback", "setWindowProperty"):
        setattr(cv2, name, window)
    for name in ("destroyAllWindows", "destroyWindow", "startWindowThread"):
        setattr(cv2, name, lambda *_: None)
    cv2.waitKey = cv2.waitKeyEx = cv2.pollKey = wait_key


def _change_aruco(cv2: Any, aruco: Any, sight: Sight) -> None:
    real: Any = getattr(aruco, "ArucoDetector", None)
    if real is not None:

        class ArucoDetector:
            """OpenCV's detector; what it returns is told.

            Not derived from it: OpenCV frees an object of a derived class as one of its own, and
            so damages Python's memory.
            """

            def __init__(self, *arguments: Any, **options: Any) -> None:
                self._real = real(*arguments, **options)

            def __getattr__(self, name: str) -> Any:
                return getattr(self._real, name)

            def detectMarkers(self, image: Any, *more: Any, **options: Any) -> Any:
                result = self._real.detectMarkers(image, *more, **options)
                sight.tell(result[1], result[0], image)
                return result

        aruco.ArucoDetector = ArucoDetector
    free = getattr(aruco, "detectMarkers", None)

    def detect_markers(image: Any, dictionary: Any, *more: Any, **options: Any) -> Any:
        if free is not None:
            result = free(image, dictionary, *more, **options)
            sight.tell(result[1], result[0], image)
            return result
        parameters = options.get("parameters") or aruco.DetectorParameters()
        corners, ids, rejected = aruco.ArucoDetector(dictionary, parameters).detectMarkers(image)
        # OpenCV 5 gives (n,), the old function gave (n, 1).
        ids = None if ids is None or not len(corners) else ids.reshape(-1, 1)
        return tuple(corners), ids, tuple(rejected)

    aruco.detectMarkers = detect_markers
    old = {
        "Dictionary_get": lambda key: aruco.getPredefinedDictionary(key),
        "DetectorParameters_create": lambda: aruco.DetectorParameters(),
        "estimatePoseSingleMarkers": _pose_function(cv2),
        "drawAxis": lambda image, *_, **__: image,
    }
    for name, function in old.items():
        if not hasattr(aruco, name):
            setattr(aruco, name, function)


def _pose_function(cv2: Any) -> Callable[..., Any]:
    import numpy as np

    def estimate(corners: Any, length: float, matrix: Any, distortion: Any, *_: Any) -> Any:
        """Return rotations and translations (n, 1, 3) from camera to marker, and the corners."""
        half = length / 2
        points = np.array(
            [[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]], np.float32
        )
        turns, shifts = [], []
        for quad in corners:
            quad = np.asarray(quad, np.float32).reshape(4, 2)
            _, turn, shift = cv2.solvePnP(points, quad, matrix, distortion)
            turns.append(turn.reshape(1, 3))
            shifts.append(shift.reshape(1, 3))
        return np.array(turns), np.array(shifts), points

    return estimate


def change_apriltag(module: Any, sight: Sight) -> None:
    """Let a detector of AprilTags in Python tell what it finds."""
    real: Any = getattr(module, "Detector", None)
    if real is None:
        return

    class Detector(real):  # type: ignore[misc]
        """The module's detector; what it returns is told."""

        def detect(self, image: Any, *more: Any, **options: Any) -> Any:
            result = super().detect(image, *more, **options)
            tags = result[0] if isinstance(result, tuple) else result
            sight.tell([each.tag_id for each in tags], [each.corners for each in tags], image)
            return result

    module.Detector = Detector
