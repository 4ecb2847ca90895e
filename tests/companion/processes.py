"""Companion programs as texts, and the simulator's end of their link without a simulator."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.airframe import Camera
from pytest_garl.companion.companion_flight import Answer, CompanionProcess, Start
from pytest_garl.landing_system import Mission

CAMERA = Camera(width_px=32, height_px=24)


def mission(camera: Camera = CAMERA) -> Mission:
    return Mission(
        gps_position_m=(10.0, 5.0),
        home_m=(1.0, 2.0, 0.2),
        search_altitude_m=10.0,
        marker_id=7,
        marker_side_m=1.5,
        marker_dictionary="DICT_5X5_50",
        camera=camera,
        time_limit_s=60.0,
    )


def script(folder: Path, text: str, name: str = "lander.py") -> Path:
    file = folder / name
    file.write_text(textwrap.dedent(text))
    return file


class Simulator:
    """Gives a program time in slices, and keeps what it printed, sent and saw."""

    def __init__(self, process: CompanionProcess) -> None:
        self.process = process
        self.printed = ""
        self.sent = b""
        self.found: list[tuple[int, list[tuple[float, float]]]] = []
        self.now_s = 0.0
        self.answer: Answer | None = None
        self.frame = 0
        self.picture: Callable[[], bytes] = lambda: bytes(3 * CAMERA.width_px * CAMERA.height_px)

    def fly(self, seconds: float, *, data: bytes = b"", frames: bool = False) -> Simulator:
        """Let the program run for a time, with a frame in each tenth of a second if asked for."""
        for _ in range(round(seconds * 50) or 1):
            if self.process.ended:
                break
            if frames and round(self.now_s * 50) % 5 == 0:
                self.frame += 1
            self.answer = self.process.exchange(self.now_s, self.frame, data, self.picture)
            self.printed += self.answer.printed
            self.sent += b"".join(data for data, _ in self.answer.sent)
            self.found += self.answer.found
            data = b""
            self.now_s = round(self.now_s + 0.02, 6)
        return self

    @property
    def failure(self) -> str:
        """The type and the message of the error that ended the program."""
        failure = self.answer.failure if self.answer else None
        return f"{failure['error']}: {failure['message']}" if failure else ""


@contextmanager
def running(
    folder: Path, text: str, *arguments: str, python: str = sys.executable, windows: str = "refuse"
) -> Iterator[Simulator]:
    """Run a program until the end of the block."""
    file = script(folder, text)
    start = Start(
        name="lander",
        python=python,
        arguments=(file.name, *arguments),
        folder=folder,
        environment={},
        windows=windows,
    )
    process = CompanionProcess(start, CAMERA, mission())
    try:
        yield Simulator(process)
    finally:
        process.close()


def gradient(camera: Camera = CAMERA) -> bytes:
    """Return a picture of which each row has its own value of blue."""
    picture = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)
    picture[:, :, 0] = np.arange(camera.height_px)[:, None]
    return picture.tobytes()


def board_picture() -> NDArray[np.uint8]:
    """Return a picture of marker 3 of DICT_4X4_50, 16 pixels wide, at (8, 4)."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    picture = np.full((CAMERA.height_px, CAMERA.width_px, 3), 255, np.uint8)
    picture[4:20, 8:24] = cv2.aruco.generateImageMarker(dictionary, 3, 16)[:, :, None]
    return picture
