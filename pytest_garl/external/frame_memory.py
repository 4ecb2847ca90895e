"""The memory in which a program finds the pictures of a flight."""

from __future__ import annotations

import fcntl
import math
import mmap
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.airframe import Camera

ALIGNED_BYTES = 4096
"""Each picture begins at a page, so that any type of number is aligned."""


class FrameMemory:
    """Memory that another process maps by a path, and that is gone when both have ended.

    It has no file: a run that is killed leaves nothing behind.
    """

    def __init__(self, camera: Camera, planes: tuple[str, ...]) -> None:
        size = (camera.height_px, camera.width_px)
        kinds: dict[str, tuple[tuple[int, ...], Any]] = {
            "image": ((*size, 3), np.uint8),
            "depth_m": (size, np.float32),
        }
        self._layout: dict[str, dict[str, Any]] = {}
        end = 0
        for name in planes:
            shape, kind = kinds[name]
            self._layout[name] = {"offset": end, "shape": list(shape), "type": np.dtype(kind).name}
            length = math.prod(shape) * np.dtype(kind).itemsize
            end += -(-length // ALIGNED_BYTES) * ALIGNED_BYTES
        self._bytes = max(end, ALIGNED_BYTES)
        self._file = os.memfd_create("garl-frames", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.ftruncate(self._file, self._bytes)
        # A process that reads mapped memory which another process has cut dies.
        fcntl.fcntl(self._file, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW)
        self._memory = mmap.mmap(self._file, self._bytes)
        self._arrays = {
            name: np.frombuffer(
                self._memory,
                dtype=kinds[name][1],
                count=math.prod(place["shape"]),
                offset=place["offset"],
            ).reshape(place["shape"])
            for name, place in self._layout.items()
        }

    @property
    def facts(self) -> dict[str, Any]:
        """Path and size of the memory, and where in it each picture lies."""
        path = f"/proc/{os.getpid()}/fd/{self._file}"
        return {"path": path, "bytes": self._bytes, **self._layout}

    def write(self, name: str, picture: NDArray[Any]) -> None:
        """Put a picture, (h, w, 3) or a depth of (h, w), where the program reads it."""
        np.copyto(self._arrays[name], picture, casting="no")

    def close(self) -> None:
        """Give the memory back."""
        self._arrays.clear()
        self._memory.close()
        os.close(self._file)
