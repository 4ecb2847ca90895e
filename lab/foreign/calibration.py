"""The calibration files that the scripts read: those of the simulated camera."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pytest_garl import Camera


class CalibrationFolder:
    """A folder with ``cameraMatrix_NAME.txt`` and ``cameraDistortion_NAME.txt``."""

    def __init__(self, camera: Camera, name: str) -> None:
        self._folder = TemporaryDirectory(prefix="garl-foreign-")
        folder = Path(self._folder.name)
        distortion = camera.distortion or (0.0,) * 5
        np.savetxt(folder / f"cameraMatrix_{name}.txt", camera.matrix, delimiter=",")
        np.savetxt(folder / f"cameraDistortion_{name}.txt", [distortion], delimiter=",")

    @property
    def prefix(self) -> str:
        """What a script puts before the names of the files."""
        return f"{self._folder.name}/"

    def close(self) -> None:
        """Remove the folder."""
        self._folder.cleanup()
