"""Observation that the landing system gets at a camera frame."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Observation
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.physics.vehicle import Quaternion, Vector

Array = TypeVar("Array", bound=np.ndarray[Any, Any])
POSITION_NOISE_M = 0.02
VELOCITY_NOISE_MPS = 0.05
"""Engineering estimate: RTK gives centimetres; 0.05 m/s is u-blox's stated accuracy (M8)."""
_NOT_PAINTED = np.zeros((0, 0, 3), np.uint8)


class LazyObservation(Observation):
    """An observation whose image is painted only for a system that looks at it.

    To paint takes longer than all the rest of a frame, and not every system looks at each.
    """

    __slots__ = ("_paint",)
    __qualname__ = "Observation"  # It shows itself under the name that users know.
    _paint: Callable[[], NDArray[np.uint8]]

    def __getattr__(self, name: str) -> Any:
        """Say which field was meant; Python calls this for names that are not there."""
        from difflib import get_close_matches

        fields = [each.name for each in dataclasses.fields(Observation)]
        near = get_close_matches(name, fields, n=1)
        hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(fields)}"
        raise AttributeError(f"Observation has no {name!r}; {hint}")

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
    position_m: Vector,
    velocity_mps: Vector,
    attitude: Quaternion,
    rangefinder_m: float | None,
    rng: np.random.Generator,
) -> Observation:
    """Return what a frame shows, the pose with noise drawn from ``rng``; arrays are read-only."""
    noise = rng.standard_normal(6)
    observation = LazyObservation(
        time_s=time_s,
        position_m=_frozen(np.array(position_m) + POSITION_NOISE_M * noise[:3]),
        velocity_mps=_frozen(np.array(velocity_mps) + VELOCITY_NOISE_MPS * noise[3:]),
        attitude=_frozen(np.array(attitude)),
        image=_NOT_PAINTED,
        depth_m=_frozen(frame.measured_m),
        rangefinder_m=rangefinder_m,
    )
    object.__setattr__(observation, "_paint", lambda: _frozen(frame.image))
    return observation


def estimation_error_m(observation: Observation, position_m: Vector) -> Vector:
    """Return the difference between the position that a system is told and the true one."""
    x, y, z = (float(value) for value in observation.position_m - np.array(position_m))
    return x, y, z


def _frozen(array: Array) -> Array:
    array.flags.writeable = False
    # A view of what is read-only cannot be made writeable again, as its owner could.
    return array.view()
