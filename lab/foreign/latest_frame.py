"""A camera whose pictures a thread takes, as programs over GStreamer have it."""

from __future__ import annotations

import threading
import time
from typing import Any

import cv2

LOOK_S = 0.03
"""What looking at a picture takes: in a flight computing takes no time."""


class LatestFrame:
    """The newest picture, which may be the same as the one before."""

    def __init__(self) -> None:
        self._frame: Any = None
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        camera = cv2.VideoCapture(0)
        while True:
            self._frame = camera.read()[1]

    def setup(self) -> Any:
        """Return the newest picture."""
        time.sleep(LOOK_S)
        return self._frame

    def frame_available(self) -> bool:
        """Return whether there is one."""
        return self._frame is not None
