"""What a flight shows the landing system at a camera frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Observation
from pytest_garl.simulation.camera.renderer import Frame

Array = TypeVar("Array", bound=np.ndarray[Any, Any])
_NOT_PAINTED = np.zeros((0, 0, 3), np.uint8)


class LazyObservation(Observation):
    """An observation whose image is painted only for a system that looks at it.

    To paint takes longer than all the rest of a frame, and not every system looks at each.
    """

    __slots__ = ("_paint",)
    _paint: Callable[[], NDArray[np.uint8]]

    @property
    def image(self) -> NDArray[np.uint8]:
        """The RGB image, read-only."""
        return self._paint()

    @image.setter
    def image(self, image: NDArray[np.uint8]) -> None:
        object.__setattr__(self, "_paint", lambda: image)


def observe(
    frame: Frame,
    *,
    time_s: float,
    position_m: NDArray[np.float64],
    velocity_mps: NDArray[np.float64],
    attitude: NDArray[np.float64],
) -> Observation:
    """Return the observation of a frame; its arrays become read-only."""
    observation = LazyObservation(
        time_s=time_s,
        position_m=_frozen(position_m),
        velocity_mps=_frozen(velocity_mps),
        attitude=_frozen(attitude),
        image=_NOT_PAINTED,
        depth_m=_frozen(frame.depth_m),
    )
    object.__setattr__(observation, "_paint", lambda: _frozen(frame.image))
    return observation


def _frozen(array: Array) -> Array:
    array.flags.writeable = False
    # A view of what is read-only cannot be made writeable again, as its owner could.
    return array.view()
